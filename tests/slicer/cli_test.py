#!/usr/bin/python3
"""surfseg-slicer as Slicer and MITK call it. Neither is needed: their calls are played."""
import fcntl
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
import unittest
import xml.etree.ElementTree as ElementTree

import host

F_SETPIPE_SZ = 1031  # fcntl has it from Python 3.10 on
HERE = os.path.dirname(os.path.abspath(__file__))
LEFT, RIGHT = (-9.75, 0.3, -0.2), (9.75, 0.3, 0.2)  # in the balls, RAS
BETWEEN = (0.1, 8.5, 0.3)


def surfseg(folder, *words):
    subprocess.run([host.SURFSEG, *words], cwd=folder, check=True, capture_output=True)


class WithVolume(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.origin = tempfile.mkdtemp(prefix="surfseg-slicer-")
        surfseg(cls.origin, "phantom", "separate-balls", "--size", "40", "--spacing", "1", "--noise", "0.05", "-o", "v.nrrd")
        cls.xml = host.run(["--xml_slicer"], cls.origin).stdout

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.origin)

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="surfseg-slicer-")
        shutil.copy(os.path.join(self.origin, "v.nrrd"), self.folder)

    def tearDown(self):
        shutil.rmtree(self.folder)

    def path(self, name):
        return os.path.join(self.folder, name)

    def content(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()

    def call(self, **values):
        return host.call(self.xml, {"inputVolume": self.path("v.nrrd"), **values}, self.path("r.params"))

    def must(self, **values):
        done = host.run(self.call(**values), self.folder)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return done

    def expect_same_as_segment(self, *words, output="s.vtp"):
        """The files s.* and l.nrrd are those of surfseg segment."""
        extension = os.path.splitext(output)[1]
        surfseg(self.folder, "segment", "v.nrrd", "--space", "lps", *words, "-o", "t" + extension,
                "--mask", "m.nrrd", "-q")
        self.assertEqual(self.content(output), self.content("t" + extension))
        self.assertEqual(self.content("l.nrrd"), self.content("m.nrrd"))


class Description(WithVolume):
    def test_is_quiet_and_quick(self):
        for flag in ("--xml", "--xml_slicer"):
            begin = time.monotonic()
            done = host.run([flag], self.folder)
            self.assertLess(time.monotonic() - begin, 5)  # Slicer's limit; some 0.1 s
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertTrue(done.stdout.startswith("<?xml "))
        self.assertEqual(os.listdir(self.folder), ["v.nrrd"])

    def test_differs_in_the_index_of_what_is_given_back_alone(self):
        ctk = host.run(["--xml"], self.folder).stdout
        self.assertEqual(ctk.replace("      <index>1000</index>\n", ""), self.xml)
        self.assertEqual(ctk.count("<index>1000</index>"), 3)

    def test_has_for_slicer_what_its_parser_asks_for(self):
        table = host.parameters(self.xml)
        names = [p.name for p in table]
        self.assertEqual(len(set(names)), len(names))
        self.assertEqual([p.name for p in table if p.is_return()], ["volume_ml", "area_cm2", "verdict"])
        for p in table:
            self.assertRegex(p.name, "^[_a-zA-Z][_a-zA-Z0-9]*$")
            self.assertIn(p.channel, ("input", "output"))
            self.assertFalse(p.flag and p.index)
            if p.tag == "string-enumeration":
                self.assertIn(p.default, p.choices)
        known = {"category", "title", "description", "version", "license", "parameters"}
        self.assertLessEqual({child.tag for child in ElementTree.fromstring(self.xml)}, known)

    def test_names_every_flag_that_the_parser_knows(self):
        text = host.run(["--help"], self.folder).stdout
        for p in host.parameters(self.xml):
            if p.flag:
                self.assertIn(f"--{p.flag} ", text)
        self.assertRegex(host.run(["--version"], self.folder).stdout, r"^surfseg-slicer \d")

    def test_lies_beside_the_program_for_slicer(self):
        folder = os.environ["SURFSEG_SLICER_FOLDER"]
        with open(os.path.join(folder, "surfseg-slicer.xml")) as file:
            self.assertEqual(file.read(), self.xml)
        # Slicer's own libraries come first in its environment; one of another build may not do.
        home = self.path("Slicer")
        os.makedirs(os.path.join(home, "lib"))
        open(os.path.join(home, "lib", "libfmt.so.9"), "w").close()
        environment = {**os.environ, "SLICER_HOME": home, "LD_LIBRARY_PATH": os.path.join(home, "lib")}
        done = host.run(["--xml_slicer"], self.folder, os.path.join(folder, "surfseg-slicer"), env=environment)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, self.xml, ""))


class Schema(WithVolume):
    def validate(self, xml):
        return subprocess.run(
            [os.environ["XMLLINT"], "--noout", "--nonet", "--relaxng",
             os.path.join(HERE, "command_line_module.rng"), "-"],
            input=xml, text=True, capture_output=True, timeout=60)

    def test_of_ctk_holds(self):
        ctk = host.run(["--xml"], self.folder).stdout
        done = self.validate(ctk)
        self.assertEqual(done.returncode, 0, done.stderr)
        # And it is no schema that takes everything.
        for good, bad in (("--edge_length", "--edge-length"), ("<index>1000</index>", ""),
                          ("<channel>input", "<channel>in"), ("<label>Volume</label>", "")):
            self.assertIn(good, ctk)
            self.assertNotEqual(self.validate(ctk.replace(good, bad)).returncode, 0, bad)


class Run(WithVolume):
    def test_gives_what_segment_gives(self):
        done = self.must(inside=[LEFT, RIGHT], outside=[BETWEEN], surface=self.path("s.vtp"),
                         labels=self.path("l.nrrd"))
        self.expect_same_as_segment("--seed", "9.75,-0.3,-0.2", "--seed", "-9.75,-0.3,0.2",
                                    "--outside", "-0.1,-8.5,0.3")
        values = host.return_values(self.path("r.params"))
        self.assertEqual(set(values), {"volume_ml", "area_cm2", "verdict"})
        surfseg(self.folder, "evaluate", "s.vtp", "--reference", "s.vtp", "--json", "e.json")
        with open(self.path("e.json")) as file:
            measured = json.load(file)
        self.assertAlmostEqual(float(values["volume_ml"]), measured["volume_mm3"] / 1000, 3)
        self.assertAlmostEqual(float(values["area_cm2"]), measured["quality"]["area_mm2"] / 100, 2)
        self.assertRegex(values["verdict"], "^(trusted|check|doubtful): ")
        for name, value in values.items():  # what MITK reads
            self.assertIn(f'<filter-result name="{name}">{value}</filter-result>', done.stdout)

    def test_gives_it_with_every_option_too(self):
        self.must(inside=[LEFT], surface=self.path("s.stl"), labels=self.path("l.nrrd"),
                  edge_length="1.2mm", sigma="0.5vox", energy="chan-vese area:weight=0.2",
                  topology="genus0", fill_cavities=True, min_component=2, keep="seeded")
        self.expect_same_as_segment(
            "--seed", "9.75,-0.3,-0.2", "--edge-length", "1.2mm", "--sigma", "0.5vox", "--energy",
            "chan-vese", "--energy", "area:weight=0.2", "--topology", "genus0", "--fill-cavities",
            "--min-component", "2", "--keep", "seeded", output="s.stl")

    def test_lets_a_preset_win_over_what_a_window_shows_at_first(self):
        with open(self.path("thin.json"), "w") as file:
            json.dump({"description": "thin", "edge-length": "1.4mm", "topology": "fixed",
                       "fill-cavities": True}, file)
        environment = {**os.environ, "SURFSEG_PRESETS": self.folder}
        done = host.run(self.call(inside=[LEFT], preset="thin", surface=self.path("s.vtp"),
                                  labels=self.path("l.nrrd")), self.folder, env=environment)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.expect_same_as_segment("--seed", "9.75,-0.3,-0.2", "--edge-length", "1.4mm", "--topology",
                                    "fixed", "--fill-cavities")

    def test_writes_either_result_alone(self):
        self.must(inside=[LEFT], labels=self.path("l.nrrd"))
        self.assertEqual(sorted(os.listdir(self.folder)), ["l.nrrd", "r.params", "v.nrrd"])
        labels = self.content("l.nrrd")
        self.must(inside=[LEFT], surface=self.path("s.vtp"), labels=self.path("l.nrrd"))
        self.assertEqual(self.content("l.nrrd"), labels)
        os.remove(self.path("l.nrrd"))
        self.must(inside=[LEFT], surface=self.path("s.vtp"))
        self.assertFalse(os.path.exists(self.path("l.nrrd")))

    def test_reads_points_from_files(self):
        points = [{"position": [-LEFT[0], -LEFT[1], LEFT[2]], "positionStatus": "defined"}]
        with open(self.path("in.mrk.json"), "w") as file:
            json.dump({"@schema": "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/"
                                  "Markups/Resources/Schema/markups-schema-v1.0.3.json#",
                       "markups": [{"type": "Fiducial", "coordinateSystem": "LPS",
                                    "controlPoints": points}]}, file)
        with open(self.path("out.fcsv"), "w") as file:
            file.write("# Markups fiducial file version = 4.11\n# CoordinateSystem = RAS\n"
                       "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
                       "1,{},{},{},0,0,0,1,1,1,0,F-1,,\n".format(*BETWEEN))
        self.must(inside_file=self.path("in.mrk.json"), outside_file=self.path("out.fcsv"),
                  surface=self.path("s.vtp"), labels=self.path("l.nrrd"))
        self.expect_same_as_segment("--seed", "9.75,-0.3,-0.2", "--outside", "-0.1,-8.5,0.3")

    def test_reads_nifti(self):
        surfseg(self.folder, "phantom", "separate-balls", "--size", "40", "--spacing", "1", "-o", "v.nii.gz")
        words = host.call(self.xml, {"inputVolume": "v.nii.gz", "inside": [LEFT], "surface": "s.vtp"}, "r")
        self.assertEqual(host.run(words, self.folder).returncode, 0)

    def test_takes_the_call_of_a_host_that_counts_what_is_given_back_as_an_argument(self):
        ctk = host.run(["--xml"], self.folder).stdout
        words = host.call(ctk, {"inputVolume": "v.nrrd", "inside": [LEFT], "surface": "s.vtp"})
        self.assertEqual(words[-2:], ["v.nrrd", "none"])
        done = host.run(words, self.folder)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_takes_several_points_in_one_word(self):
        words = ["v.nrrd", "--inside", "9.75,-0.3,-0.2;-9.75,-0.3,0.2", "--surface", "s.vtp", "--labels",
                 "l.nrrd", "--progress", "none"]
        done = host.run(words, self.folder)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))
        self.expect_same_as_segment("--seed", "9.75,-0.3,-0.2", "--seed", "-9.75,-0.3,0.2")


class Progress(WithVolume):
    def start(self, **more):
        """A run of seconds."""
        surfseg(self.folder, "phantom", "ball", "--size", "96", "--spacing", "1", "-o", "v.nrrd")
        words = self.call(inside=[(0, 0, 0)], energy="minimal-surface", edge_length="0.7mm",
                          surface=self.path("s.stl"))
        return subprocess.Popen([host.PROGRAM, *words], cwd=self.folder, stderr=subprocess.PIPE, **more)

    def test_comes_while_it_runs_and_leaves_nothing_else(self):
        surfseg(self.folder, "phantom", "ball", "--size", "64", "--spacing", "1", "-o", "v.nrrd")
        done = self.must(inside=[(0, 0, 0)], edge_length="1mm", energy="minimal-surface",
                         surface=self.path("s.vtp"))
        shares = host.progress(done.stdout)
        self.assertGreater(len(shares), 2, done.stdout)
        self.assertEqual((shares[0], shares[-1]), (0, 1))
        self.assertEqual(shares, sorted(shares))
        self.assertTrue(done.stdout.startswith("<filter-start>"))
        self.assertRegex(done.stdout, r"<filter-end>.*</filter-end>\n$")
        for line in host.without_tags(done.stdout).splitlines():
            self.assertTrue(line.startswith("<filter-result "), line)
        # MITK reads it as XML, in an element of its own.
        ElementTree.fromstring("<module-root>" + done.stdout + "</module-root>")

    def test_is_flushed_and_an_interrupt_leaves_the_last_good_surface(self):
        # The pipe holds one write: the program waits until it is read, however slow either side is.
        out, into = os.pipe2(os.O_DIRECT | os.O_CLOEXEC)
        fcntl.fcntl(into, F_SETPIPE_SZ, 1)
        with self.start(stdout=into) as process:
            os.close(into)
            is_sent = False
            while part := os.read(out, 4096):
                if not is_sent and b"evolve, step" in part:
                    process.send_signal(signal.SIGINT)
                    is_sent = True
            errors = process.stderr.read()
        os.close(out)
        self.assertEqual((is_sent, process.returncode, errors), (True, 130, b""))
        self.assertGreater(len(self.content("s.stl")), 1000)

    def test_of_a_killed_run_leaves_no_broken_file(self):
        with self.start(stdout=subprocess.PIPE) as process:
            process.stdout.readline()
            process.kill()  # Slicer's Cancel
            process.communicate(timeout=60)
        self.assertFalse(os.path.exists(self.path("s.stl")))


class WrongInput(WithVolume):
    def refused(self, code, words, **values):
        values.setdefault("surface", self.path("s.vtp"))
        done = host.run(self.call(**values), self.folder)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertRegex(done.stderr, r"^surfseg-slicer: error: [^\n]*\n$")
        self.assertIn(words, done.stderr)
        self.assertNotIn("<filter-end>", done.stdout)
        self.assertFalse(os.path.exists(self.path("s.vtp")))
        self.assertFalse(os.path.exists(self.path("r.params")))

    def test_is_one_line_and_a_code(self):
        self.refused(2, "--inside: at least one point inside")
        self.refused(2, "--surface, --labels", inside=[LEFT], surface="")
        self.refused(2, "--inside: (900, 1, 0) mm is voxel", inside=[(900, 1, 0)])
        self.refused(2, "--outside: ", inside=[LEFT], outside=[LEFT])
        self.refused(2, "--edge_length: expected a length with its unit", inside=[LEFT], edge_length="2")
        self.refused(2, "weight: expected a number", inside=[LEFT], energy="chan-vese:weight=x")
        self.refused(2, "'chan-vase'", inside=[LEFT], energy="chan-vase")
        self.refused(2, "--topology: cube not in", inside=[LEFT], topology="cube")
        for name in ("s.txt", "s.gii", "s.glb", "s.3mf", "s.dcm"):
            self.refused(2, f"--surface: {name}: expected a name that ends in .vtp, .stl, .ply or .obj", inside=[LEFT], surface=name)
        self.refused(2, "--labels: l.txt", inside=[LEFT], labels="l.txt")
        self.refused(2, "is the input too", inside=[LEFT], labels=self.path("v.nrrd"))
        self.refused(3, "gone.nrrd", inside=[LEFT], inputVolume="gone.nrrd")
        self.refused(3, "gone.fcsv", inside_file="gone.fcsv")
        self.refused(4, "--surface: none/s.vtp", inside=[LEFT], surface="none/s.vtp")
        self.refused(8, "no object", inside=[(-0.2, 18.9, 18.8)])

    def test_of_the_command_line_too(self):
        for words, text in ((["v.nrrd", "--edge-length", "2mm"], "did you mean '--edge_length'?"),
                            (["v.nrrd", "w.nrrd", "--inside", "0,0,0"], "'w.nrrd' is one argument too many"),
                            (["v.nrrd", "--inside", "a,b,c", "--surface", "s.stl"], "--inside: expected three"),
                            ([], "inputVolume")):
            done = host.run(words, self.folder)
            self.assertEqual(done.returncode, 2)
            self.assertIn(text, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1)


if __name__ == "__main__":
    unittest.main()
