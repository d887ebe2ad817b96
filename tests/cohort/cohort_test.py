"""tools/cohort without a cluster: what it reads from headers and lists, and which cases it does again."""
import gzip
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.environ["SURFSEG_COHORT"])
import cohort  # noqa: E402

PROGRAM = os.environ["SURFSEG_PROGRAM"]
FOLDER = pathlib.Path(os.environ["SURFSEG_TEST_FOLDER"])

# In place of surfseg: a case ends as its column `ends` says, and is counted.
STAND_IN = """#!/usr/bin/python3
import json, pathlib, sys
sys.path.insert(0, {folder!r})
import cohort
if sys.argv[1:] == ["--version"]:
    print("surfseg of the test")
    sys.exit()
cases, words = cohort.read_cases(sys.argv[2]), sys.argv
if "--collect" in words:
    sys.exit()
row, rows = words[words.index("--shard") + 1].split("/")
assert int(rows) == len(cases)
case = cases[int(row) - 1]
with open("ran.txt", "a") as ran:
    ran.write(case.name + "\\n")
end = case.cells.get("ends", "done")
if end == "killed":
    sys.exit(137)
path = pathlib.Path(words[4]) / f"sub-{{case.name}}/anat/sub-{{case.name}}_desc-surfseg_surfseg.json"
path.parent.mkdir(parents=True, exist_ok=True)
path.write_text(json.dumps({{"message": {{"memory": "out of memory; crop", "failed": "no object"}}.get(end, "")}}))
sys.exit(0 if end == "done" else 7)
"""


class InAFolder(unittest.TestCase):
    def setUp(self):
        shutil.rmtree(FOLDER, ignore_errors=True)
        FOLDER.mkdir(parents=True)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(FOLDER)


class Needs(InAFolder):
    def test_voxels_are_those_of_the_header(self):
        for name in ("v.nii", "v.nii.gz", "v.mha", "v.nrrd"):
            subprocess.run([PROGRAM, "phantom", "ball", "--size", "31,20,17", "--spacing", "1", "-o", name], check=True)
            self.assertEqual(cohort.voxels(FOLDER / name), 31 * 20 * 17, name)
        big_endian = struct.pack(">i36x8h", 348, 4, 512, 512, 300, 9, 1, 1, 1)
        pathlib.Path("big.nii").write_bytes(big_endian.ljust(352, b"\0"))
        self.assertEqual(cohort.voxels(FOLDER / "big.nii"), 512 * 512 * 300)
        second = struct.pack("<i12x8q", 540, 3, 70000, 3, 2, 1, 1, 1, 1)
        with gzip.open("second.nii.gz", "wb") as file:
            file.write(second.ljust(544, b"\0"))
        self.assertEqual(cohort.voxels(FOLDER / "second.nii.gz"), 420000)
        pathlib.Path("v.vti").write_text('<VTKFile type="ImageData"><ImageData WholeExtent="0 9 5 14 -1 3" Origin="0 0 0">')
        self.assertEqual(cohort.voxels(FOLDER / "v.vti"), 10 * 10 * 5)

    def test_other_scans_are_taken_by_their_bytes_and_none_is_an_error(self):
        (FOLDER / "dicom").mkdir()
        for n in range(3):
            (FOLDER / f"dicom/{n}.dcm").write_bytes(bytes(1000))
        self.assertEqual(cohort.voxels(FOLDER / "dicom"), 1500)
        (FOLDER / "dicom/1.dcm").write_bytes(bytes(128) + b"DICM" + bytes(868))  # the others are read along with it
        self.assertEqual(cohort.voxels(FOLDER / "dicom/1.dcm"), 1500)
        pathlib.Path("cut.nii.gz").write_bytes(gzip.compress(bytes(range(256)) * 99)[:40])
        self.assertEqual(cohort.voxels(FOLDER / "cut.nii.gz"), 0)
        damaged = bytearray(gzip.compress(os.urandom(9000)))
        damaged[10:] = b"\xff" * (len(damaged) - 10)
        pathlib.Path("damaged.nii.gz").write_bytes(damaged)
        self.assertEqual(cohort.voxels(FOLDER / "damaged.nii.gz"), 0)
        self.assertEqual(cohort.voxels(FOLDER / "nowhere.nii"), 0)

    def test_a_job_needs_what_its_largest_case_does_and_each_attempt_twice_that(self):
        for name, size in (("small", 10), ("large", 300)):
            pathlib.Path(f"{name}.nii").write_bytes(struct.pack("<i36x8h", 348, 3, size, size, size, 1, 1, 1, 1))
        pathlib.Path("list.tsv").write_text("name\tscan\na\tsmall.nii\nb\tlarge.nii\nc\tsmall.nii\n")
        jobs = cohort.Cohort("list.tsv", "out", per_job=2, surfseg=PROGRAM).jobs
        self.assertEqual([(job.name, len(job.cases)) for job in jobs], [("a", 2), ("c", 1)])
        self.assertEqual(jobs[0].memory_mb(), 500 + 32 * 27)
        self.assertEqual(jobs[0].memory_mb(attempt=3), 4 * jobs[0].memory_mb())
        self.assertEqual((jobs[0].minutes(), jobs[0].minutes(attempt=2)), (11 + 13, 48))
        half = cohort.Cohort("list.tsv", "out", surfseg=PROGRAM, memory=0.5)
        self.assertEqual(half.job("b").memory_mb(), (500 + 32 * 27) // 2)


class List(InAFolder):
    def test_names_are_bytes(self):
        pathlib.Path("list.tsv").write_bytes(b"name\tscan\na\tm\xfcller.nii\n")
        self.assertEqual(os.fsencode(cohort.read_cases("list.tsv")[0].scan), b"m\xfcller.nii")
        done = subprocess.run([sys.executable, cohort.__file__, "needs", "list.tsv", "-o", "out", "--surfseg", PROGRAM],
                              capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout.split()[-4]), (0, "a"), done.stderr)

    def test_rows_and_names_are_those_that_surfseg_sees(self):
        pathlib.Path("list.tsv").write_bytes(
            b"\xef\xbb\xbf# a comment\r\n\r\nscan\tname \tclicks\trecipe\r\na.nii\tsub-one\t1,2,3\tn/a\r\n  \r\n#x.nii\tno\t1,2,3\r\n"
            b" b.nii\ttwo\t 1,2,3; !4,5,6\r\nc.nii\tthree\tmarks.txt\t\r\n")
        cases = cohort.read_cases("list.tsv")
        subprocess.run([PROGRAM, "batch", "list.tsv", "-o", "out", "--collect", "-q"], check=True)
        table = pathlib.Path("out/group.tsv").read_text().splitlines()[1:]
        self.assertEqual([case.name for case in cases], [line.split("\t")[0] for line in table])
        self.assertEqual([str(case.scan) for case in cases], [line.split("\t")[-2] for line in table])
        done = subprocess.run([PROGRAM, "batch", "list.tsv", "-o", "out", "--shard", f"{cases[1].row}/{len(cases)}"],
                              capture_output=True, text=True)
        self.assertIn("[1/1] two: failed (3): b.nii", done.stderr)

    def test_a_list_that_surfseg_refuses_makes_no_job(self):
        pathlib.Path("list.tsv").write_text("name\tscan\tclickz\na\ta.nii\t1,2,3\n")
        done = subprocess.run([sys.executable, cohort.__file__, "submit", "list.tsv", "-o", "out", "--surfseg", PROGRAM],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 3)
        self.assertIn("did you mean 'clicks'", done.stderr)
        self.assertFalse(pathlib.Path("out").exists() or pathlib.Path("out.jobs").exists())

    def test_files_are_those_that_are_there(self):
        for name in ("a.nii", "p.txt", "r.json"):
            pathlib.Path(name).touch()
        pathlib.Path("list.tsv").write_text("name\tscan\tclicks\treference\na\ta.nii\tp.txt\tnone.nii\nb\tb.nii\t1,2,3; !4,5,6\n")
        self.assertEqual([[str(file) for file in case.files] for case in cohort.read_cases("list.tsv")], [["a.nii", "p.txt"], []])


# Header, and what its voxels are in.
DETACHED = {
    "a.mhd": (b"NDims = 3\r\nElementDataFile = voxels/a.zraw\r\n", ["voxels/a.zraw"]),
    "b.nhdr": (b"NRRD0004\ntype: short\ndata file: b of c.raw.gz\nencoding: gzip\n", ["b of c.raw.gz"]),
    "c.hdr": (b"\x5c\x01", ["c.img.gz"]),
    "d.img": (b"\n\xff\n", ["d.hdr"]),
    "e.nhdr": (b"NRRD0004\ndatafile: LIST\ne-1.raw\n./e-2.raw\n", ["e-1.raw", "e-2.raw"]),
    "f.nrrd": (b"NRRD0004\ndata file: f%03d.raw 1 2 1\n", ["f001.raw", "f002.raw"]),
    "dicom/1.dcm": (bytes(128) + b"DICM", ["dicom/2.dcm"]),
    "folder": (None, ["folder/2.dcm"]),
}


class Rules(InAFolder):
    def setUp(self):
        super().setUp()
        program = FOLDER / "program"
        program.write_text(STAND_IN.format(folder=os.environ["SURFSEG_COHORT"]))
        program.chmod(0o755)
        pathlib.Path("a.nii").touch()

    def read(self, *ends):
        """A cohort of one job, whose cases end so."""
        rows = "".join(f"c{n}\ta.nii\t{end}\n" for n, end in enumerate(ends))
        pathlib.Path("list.tsv").write_text("name\tscan\tends\n" + rows)
        out = cohort.Cohort("list.tsv", "out", per_job=len(ends), surfseg=str(FOLDER / "program"))
        out.folder.mkdir(exist_ok=True)
        return out

    def run_job(self, cohort, attempt=1):
        """Exit code, and which cases were run."""
        pathlib.Path("ran.txt").write_text("")
        code = cohort.run(cohort.jobs[0], attempt, 1)
        return code, pathlib.Path("ran.txt").read_text().split()

    def test_what_has_failed_is_left_in_the_next_attempt_but_not_in_the_next_run(self):
        one = self.read("done", "failed")
        self.assertEqual(self.run_job(one), (7, ["c0", "c1"]))
        self.assertEqual(self.run_job(one, attempt=2), (7, ["c0"]))
        self.assertEqual(self.run_job(one, attempt=3), (7, ["c0"]))
        self.assertEqual(self.run_job(one), (7, ["c0", "c1"]))
        self.assertFalse(one.jobs[0].is_done())

    def test_what_was_killed_or_lacked_memory_is_tried_again(self):
        for end in ("killed", "memory"):
            one = self.read("done", end)
            self.assertEqual(self.run_job(one), (cohort.AGAIN, ["c0", "c1"]), end)
            self.assertEqual(self.run_job(one, attempt=2), (cohort.AGAIN, ["c0", "c1"]), end)
        both = self.read("failed", "killed")
        self.assertEqual(self.run_job(both), (cohort.AGAIN, ["c0", "c1"]))
        self.assertEqual(self.run_job(both, attempt=2), (cohort.AGAIN, ["c1"]))

    def test_submit_tries_again_where_one_case_lacked_memory_and_another_failed_for_good(self):
        (FOLDER / "sbatch").write_text("#!/bin/sh\necho 5\n")
        (FOLDER / "sbatch").chmod(0o755)

        def second_attempt(*ends):
            """What it says, and which jobs it has submitted."""
            shutil.rmtree("out.jobs", ignore_errors=True)
            self.run_job(self.read(*ends))
            done = subprocess.run(
                [sys.executable, os.path.abspath(cohort.__file__), "submit", "list.tsv", "-o", "out", "--per-job", str(len(ends)),
                 "--surfseg", str(FOLDER / "program"), "--attempt", "2"], capture_output=True, text=True, check=True,
                env={**os.environ, "PATH": f"{FOLDER}:{os.environ['PATH']}"})
            return done.stdout, [path.read_text() for path in pathlib.Path("out.jobs").glob("array-*.txt")]

        for end in ("memory", "killed"):
            said, jobs = second_attempt("failed", end)
            self.assertIn("1 of 1 jobs in 1 array, attempt 2", said, end)
            self.assertEqual(jobs, ["c0\n"], end)
        self.assertEqual(second_attempt("failed", "done"), ("", []))
        # What the first attempt left to be tried again is over when it comes to an end.
        both = self.read("failed", "memory")
        self.run_job(both)
        self.assertFalse(both.jobs[0].has_failed())
        (FOLDER / "list.tsv").write_text((FOLDER / "list.tsv").read_text().replace("memory", "done"))
        self.run_job(both, attempt=2)
        self.assertTrue(both.jobs[0].has_failed())

    def test_a_job_is_done_until_a_row_or_a_file_or_the_program_changes(self):
        one = self.read("done")
        self.assertEqual(self.run_job(one)[0], 0)
        self.assertTrue(one.jobs[0].is_done())
        self.assertFalse(self.read("done", "done").jobs[0].is_done())
        one = self.read("done")
        self.assertTrue(one.jobs[0].is_done())
        later = time.time() + 10
        os.utime("a.nii", (later, later))
        self.assertFalse(one.jobs[0].is_done())
        os.utime("a.nii", (0, 0))
        program = FOLDER / "program"
        program.write_text(program.read_text().replace("surfseg of the test", "surfseg of tomorrow"))
        self.assertFalse(self.read("done").jobs[0].is_done())

    def test_results_that_have_gone_are_made_again(self):
        one = self.read("done", "done")
        self.run_job(one)
        self.assertTrue(one.jobs[0].is_done())
        shutil.rmtree("out/sub-c1")
        self.assertFalse(one.jobs[0].is_done())

    @unittest.skipUnless(shutil.which("snakemake"), "snakemake is missing")
    def test_results_that_have_gone_are_made_again_by_snakemake(self):
        self.read("done", "done")

        def run():
            """Which cases were run."""
            pathlib.Path("ran.txt").write_text("")
            subprocess.run(["snakemake", "-s", os.path.join(os.environ["SURFSEG_COHORT"], "Snakefile"), "-c", "1", "--config",
                            "list=list.tsv", "output=out", f"surfseg={FOLDER / 'program'}"], capture_output=True, check=True)
            return sorted(pathlib.Path("ran.txt").read_text().split())

        self.assertEqual(run(), ["c0", "c1"])
        self.assertEqual(run(), [])
        shutil.rmtree("out/sub-c1")
        self.assertEqual(run(), ["c1"])
        self.assertEqual(run(), [])

    def test_a_job_is_done_until_what_is_read_along_with_its_scan_changes(self):
        for scan, (header, beside) in DETACHED.items():
            for name in [scan, *beside]:
                pathlib.Path(name).parent.mkdir(exist_ok=True)
                if header is not None or name != scan:
                    pathlib.Path(name).write_bytes(header if name == scan else b"")
                    os.utime(name, (1, 1))
            pathlib.Path("list.tsv").write_text(f"name\tscan\nc0\t{scan}\n")
            one = cohort.Cohort("list.tsv", "out", surfseg=str(FOLDER / "program"))
            one.folder.mkdir(exist_ok=True)
            self.assertEqual(self.run_job(one)[0], 0)
            self.assertTrue(one.jobs[0].is_done(), scan)
            self.assertLessEqual({scan, *beside}, set(one.jobs[0].files), scan)
            later = time.time() + 10
            for name in beside:
                os.utime(name, (later, later))
                self.assertFalse(one.jobs[0].is_done(), name)
                os.utime(name, (1, 1))

    def test_numbers_that_cannot_be_are_refused_and_a_failed_sbatch_is_one_line(self):
        self.read("done")
        script = os.path.abspath(cohort.__file__)
        words = ["list.tsv", "-o", "out", "--surfseg", str(FOLDER / "program")]
        for wrong in (["--per-job", "0"], ["--memory", "-1"], ["--memory", "nan"], ["--attempt", "0"], ["--per-job", "x"]):
            refused = subprocess.run([sys.executable, script, "needs", *words, *wrong], capture_output=True, text=True)
            self.assertEqual(refused.returncode, 2, wrong)
            self.assertNotIn("Traceback", refused.stderr)
        (FOLDER / "sbatch").write_text("#!/bin/sh\necho 'sbatch: error: no cluster' >&2\nexit 1\n")
        (FOLDER / "sbatch").chmod(0o755)
        failed = subprocess.run([sys.executable, script, "submit", *words], capture_output=True, text=True,
                                env={**os.environ, "PATH": f"{FOLDER}:{os.environ['PATH']}"})
        self.assertEqual(failed.returncode, 3)
        self.assertEqual(failed.stderr.splitlines()[-1], "cohort.py: error: sbatch ended with 1")
        self.assertNotIn("Traceback", failed.stderr)

    def test_collecting_takes_away_what_killed_jobs_have_left(self):
        one = self.read("done")
        pathlib.Path("out").mkdir(exist_ok=True)
        for name in (".surfseg-12-group.html", ".surfseg-13-group.tsv", ".bidsignore"):
            pathlib.Path("out", name).touch()
        os.utime("out/.surfseg-12-group.html", (1, 1))
        (FOLDER / "out/.sub-c0.partial-used12/sub-c0/anat").mkdir(parents=True)  # of one that runs, perhaps
        self.assertEqual(one.collect(), 0)
        self.assertEqual(sorted(os.listdir("out")), [".bidsignore", ".sub-c0.partial-used12", ".surfseg-13-group.tsv"])


if __name__ == "__main__":
    unittest.main()
