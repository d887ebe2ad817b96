"""A cohort on a Slurm of one node, by Snakemake and by a job array: jobs are killed, and the bytes are those of one machine."""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time
import unittest

import slurm

PROGRAM = os.environ["SURFSEG_PROGRAM"]
COHORT = pathlib.Path(os.environ["SURFSEG_COHORT"])
FOLDER = pathlib.Path(os.environ["SURFSEG_TEST_FOLDER"])
KINDS = ("ball", "torus", "box", "vessel", "shell")
CLICKS = {"torus": "8,0,0", "shell": "7,0,0"}
BROKEN = ("c04", "c09")  # a file that is damaged, one that is not there


def surfseg(*words, code=0):
    done = subprocess.run([PROGRAM, *words], cwd=FOLDER, capture_output=True, text=True)
    assert done.returncode == code, (words, done.returncode, done.stderr)


def phantom(name, kind, size=32, seed=0):
    surfseg("phantom", kind, "--size", str(size), "--spacing", "1", "--noise", "0.05", "--random-seed", str(seed), "-o", name)


def make_cohort():
    """Twelve phantoms, two of which are broken, and what becomes of them on one machine."""
    rows = ["# twelve", "name\tscan\tclicks"]
    for n in range(1, 13):
        name, kind = f"c{n:02}", KINDS[n % len(KINDS)]
        rows.append(f"{name}\t{name}.nii.gz\t{CLICKS.get(kind, '0,0,0')}")
        if name != BROKEN[1]:
            phantom(f"{name}.nii.gz", kind, seed=n)
    damaged = FOLDER / f"{BROKEN[0]}.nii.gz"
    damaged.write_bytes(damaged.read_bytes()[:1000])
    (FOLDER / "list.tsv").write_text("\n".join(rows) + "\n")
    surfseg("batch", "list.tsv", "-o", "local", "-q", code=7)


def content(name):
    """Of every file in a folder, but of folders that a killed job may have left: surfseg sees later that nobody uses them."""
    folder = FOLDER / name
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*")
            if path.is_file() and ".partial-" not in str(path)}


def summaries(name):
    """When each was written."""
    return {path.parent.parent.name: path.stat().st_mtime_ns for path in (FOLDER / name).glob("sub-*/anat/*_surfseg.json")}


class WithSlurm(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(FOLDER, ignore_errors=True)
        FOLDER.mkdir(parents=True)
        make_cohort()
        cls.slurm = slurm.Slurm(FOLDER / "slurm")
        cls.enterClassContext(cls.slurm)

    @classmethod
    def tearDownClass(cls):
        cls.doClassCleanups()
        left = cls.slurm.processes()
        assert not left, f"still there: {left}"

    def until(self, condition, limit=300):
        end = time.time() + limit
        while not condition():
            self.assertLess(time.time(), end, self.slurm.ask("squeue"))
            time.sleep(0.1)

    def jobs(self):
        """All that Slurm has seen: name or task, state, memory."""
        text = self.slurm.ask("scontrol", "-o", "show", "jobs")
        return [dict(re.findall(r"(\w+)=(\S*)", line)) for line in text.splitlines() if "JobId=" in line]

    def running(self, name=""):
        return [line.split()[0] for line in self.slurm.ask("squeue", "--noheader", "--states=RUNNING", "-o", "%i %j").splitlines()
                if line.split()[1].startswith(name)]

    def n_done(self, name):
        return len(list((FOLDER / f"{name}.jobs").glob("*.done")))

    def assert_same_as_local(self, name):
        one, other = content("local"), content(name)
        self.assertEqual(sorted(one), sorted(other))
        self.assertEqual([path for path in one if one[path] != other[path]], [])


class Snakemake(WithSlurm):
    def snakemake(self, *words):
        self.log = open(FOLDER / "snakemake.log", "w")
        self.addCleanup(self.log.close)
        return subprocess.Popen(
            ["snakemake", "-s", COHORT / "Snakefile", "--profile", COHORT / "profile", *words, "--config", "list=list.tsv",
             "output=out", f"surfseg={PROGRAM}"], cwd=FOLDER, stdout=self.log, stderr=self.log,
            env={**self.slurm.environment, "CI": "true"})  # it asks for jobs each second, not every ten

    def said(self):
        return (FOLDER / "snakemake.log").read_text()

    def test_jobs_are_killed_and_the_bytes_are_those_of_one_machine(self):
        run = self.snakemake()
        self.until(lambda: self.n_done("out") >= 2 and self.running("surfseg-"))
        victim = self.running("surfseg-")[0]
        self.slurm.ask("scancel", victim)
        # It comes again by itself, with twice the memory.
        killed = next(job for job in self.jobs() if job["JobId"] == victim)
        self.until(lambda: len([j for j in self.jobs() if j["JobName"] == killed["JobName"]]) > 1)
        again = [job for job in self.jobs() if job["JobName"] == killed["JobName"]][-1]
        memory = [int(job["MinMemoryNode"].rstrip("MG")) for job in (killed, again)]
        self.assertEqual(memory[1], 2 * memory[0])

        self.until(lambda: self.n_done("out") >= 5)
        run.send_signal(signal.SIGINT)
        self.assertNotEqual(run.wait(120), 0, self.said())
        self.until(lambda: not self.slurm.ask("squeue", "--noheader"))
        before = summaries("out")
        done = {f"sub-{path.stem}" for path in (FOLDER / "out.jobs").glob("*.done")}
        self.assertLess(len(done), 10, "it was interrupted too late to say anything")

        run = self.snakemake()
        self.assertEqual(run.wait(600), 1, self.said())  # two have failed
        after = summaries("out")
        self.assertEqual({name: before[name] for name in done}, {name: after[name] for name in done}, "a case was repeated")
        self.assertEqual(self.n_done("out"), 10)
        self.assert_same_as_local("out")
        table = (FOLDER / "out/group.tsv").read_text().splitlines()
        self.assertEqual(sorted(line.split("\t")[0] for line in table[1:3]), list(BROKEN), "failures come first")

        # What was broken is mended, a row has changed: three jobs.
        for name in BROKEN:
            phantom(f"{name}.nii.gz", "ball", seed=7)
        text = (FOLDER / "list.tsv").read_text()
        (FOLDER / "list.tsv").write_text(text.replace("c05.nii.gz\t0,0,0", "c05.nii.gz\t1,0,0"))
        self.assertNotEqual(text, (FOLDER / "list.tsv").read_text())
        run = self.snakemake()
        self.assertEqual(run.wait(600), 0, self.said())
        last = summaries("out")
        self.assertEqual(sorted(name for name in last if last[name] != after[name]), ["sub-c04", "sub-c05", "sub-c09"])
        surfseg("batch", "list.tsv", "-o", "local", "-q")
        self.assert_same_as_local("out")


class JobArray(WithSlurm):
    def cohort(self, *words, code=0):
        done = subprocess.run([sys.executable, COHORT / "cohort.py", *words, "--surfseg", PROGRAM], cwd=FOLDER,
                              env=self.slurm.environment, capture_output=True, text=True)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stdout + done.stderr

    def finished(self, name):
        """No job is left, and the last one has collected."""
        self.until(lambda: not self.slurm.ask("squeue", "--noheader"))
        return max((FOLDER / f"{name}.jobs").glob("collect-*.out")).read_text()

    def test_a_killed_task_comes_again_and_the_bytes_are_those_of_one_machine(self):
        said = self.cohort("submit", "list.tsv", "-o", "out", "--per-job", "2", "--at-once", "2")
        self.assertIn("6 of 6 jobs in 1 array, attempt 1", said)
        self.assertIn("jobs are still there", self.cohort("submit", "list.tsv", "-o", "out", code=2))
        self.until(lambda: self.running("surfseg"))
        victim = self.running("surfseg")[0]
        self.slurm.ask("scancel", victim)
        self.assertIn("2 failed, 10 done", self.finished("out"))
        self.assertTrue((FOLDER / "out.jobs/array-2-1.txt").exists(), "what was killed has not come again")
        self.assertEqual(len((FOLDER / "out.jobs/array-2-1.txt").read_text().splitlines()), 1)
        self.assert_same_as_local("out")
        # Again: what has failed alone.
        before = summaries("out")
        self.assertIn("2 of 6 jobs", self.cohort("submit", "list.tsv", "-o", "out", "--per-job", "2"))
        self.finished("out")
        after = summaries("out")
        self.assertEqual(sorted(name for name in after if after[name] != before[name]), [f"sub-{name}" for name in BROKEN])
        self.assert_same_as_local("out")

    def test_what_needs_more_memory_gets_it(self):
        phantom("large.nii.gz", "torus", size=128)
        (FOLDER / "large.tsv").write_text("name\tscan\tclicks\nlarge\tlarge.nii.gz\t32,0,0\n")
        self.cohort("submit", "large.tsv", "-o", "large", "--memory", "0.2")
        self.assertIn("1 done", self.finished("large"))
        self.assertIn("Exceeded job memory limit", (FOLDER / "large.jobs/array-1-1-1.out").read_text())
        self.assertTrue((FOLDER / "large.jobs/array-2-1.txt").exists())


if __name__ == "__main__":
    missing = slurm.missing() + [name for name in ("snakemake",) if "Snakemake" in sys.argv and shutil.which(name) is None]
    if missing:
        print("skipped:", ", ".join(missing), "missing; tools/setup.sh --cluster installs Slurm and Snakemake")
        sys.exit(77)
    unittest.main()
