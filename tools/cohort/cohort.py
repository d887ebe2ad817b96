#!/usr/bin/env python3
"""surfseg batch on a cluster: what a case needs, the cases of one job, a job array without Snakemake. Python alone."""
import argparse
import glob
import gzip
import json
import math
import os
import pathlib
import re
import shlex
import subprocess
import sys
import time
import zlib

# Cells that may name files; a cell of clicks does if it is no point.
FILE_COLUMNS = ("scan", "clicks", "recipe", "reference", "marks", "initial", "landmarks")
# Half as much memory again as measured, ten times the time (docs/cohort.md).
BASE_MB, BYTES_PER_VOXEL = 500, 32
BASE_MINUTES, VOXELS_PER_MINUTE = 10, 10e6
RETRIES = 2
AGAIN = 75  # exit code: more memory or time may help
LARGEST_ARRAY = 1000
LONG_AGO_S = 3600  # no file is on its way for so long


def newest(folder):
    """What was written there last: a folder itself has the time when files came or went."""
    files = [file for file in folder.iterdir() if file.is_file()]
    return [max(files, key=lambda file: (file.stat().st_mtime, file))] if files else []


def data_files(start, folder):
    """Those that the header of a MetaImage or an NRRD names for its voxels."""
    found = re.search(r"^(?:ElementDataFile|data ?file)[ \t]*[=:][ \t]*(.+)", start, re.MULTILINE | re.IGNORECASE)
    if not found:
        return []
    names = start[found.end():].split("\n") if found[1].startswith("LIST") else [found[1]]
    paths = [folder / name.strip() for name in names if name.strip()]
    if "%" in found[1]:  # such as slice%03d.raw 1 40 1
        pattern = re.sub(r"( +-?\d+){3,4}$", "", glob.escape(str(paths[0])))
        paths = [pathlib.Path(name) for name in glob.glob(re.sub(r"%\d*[a-z]", "*", pattern))]
    return paths


def is_dicom(start):
    return start[128:132] == b"DICM"


def files_beside(path, is_scan):
    """Of a folder, or a scan that is one file of a DICOM series, the newest; of a header or half of a pair the others."""
    try:
        if path.is_dir():
            return newest(path)
        with open(path, "rb") as file:
            start = file.read(2**18)
        if is_scan and is_dicom(start):
            return newest(path.parent)
        others = data_files(os.fsdecode(start), path.parent)
        if half := re.fullmatch(r"(.+)\.(?:hdr|img)(?:\.gz)?", path.name, re.IGNORECASE):
            others += [path.with_name(half[1] + ending) for ending in (".hdr", ".HDR", ".hdr.gz", ".img", ".IMG", ".img.gz")]
        return [file for file in others if file.is_file() and file != path]
    except OSError:  # surfseg says what it is
        return []


class Case:
    """A row of the list; `row` counts from 1, as --shard does."""

    def __init__(self, row, cells, folder):
        self.row, self.cells = row, cells
        self.name = cells.get("name", "").removeprefix("sub-")
        self.scan = folder / cells.get("scan", "")
        named = [part.strip() for column in FILE_COLUMNS for part in cells.get(column, "").split(";")]
        self.named = [folder / name for name in named if name]

    @property
    def files(self):
        """Those that are there, and by whose times one sees that what is read along with them has changed."""
        return [file for path in self.named if path.exists() for file in (path, *files_beside(path, path == self.scan))]

    def memory_mb(self):
        return BASE_MB + math.ceil(voxels(self.scan) * BYTES_PER_VOXEL / 1e6)

    def minutes(self):
        return BASE_MINUTES + math.ceil(voxels(self.scan) / VOXELS_PER_MINUTE)


def read_cases(path):
    """The rows as surfseg batch reads them; what is wrong with them it says itself."""
    columns, cases = None, []
    text = pathlib.Path(path).read_text(encoding="utf-8-sig", errors="surrogateescape")  # names are bytes
    for line in text.split("\n"):
        if line.startswith("#") or not line.strip():
            continue
        cells = [cell.strip(" \r") for cell in line.split("\t")]
        if columns is None:
            columns = cells
            continue
        cells = {column: cell for column, cell in zip(columns, cells) if cell not in ("", "n/a")}
        cases.append(Case(len(cases) + 1, cells, pathlib.Path(path).parent))
    return cases


def head(path, n_bytes=4096):
    with open(path, "rb") as file:
        start = file.read(n_bytes)
    if start[:2] != b"\x1f\x8b":
        return start
    with gzip.open(path) as file:
        return file.read(n_bytes)


def nifti_size(start):
    for order in ("little", "big"):
        n_bytes, at, width = int.from_bytes(start[:4], order), 40, 2
        if n_bytes == 540:
            at, width = 16, 8
        if n_bytes in (348, 540):
            return [int.from_bytes(start[at + width * n:at + width * (n + 1)], order) for n in (1, 2, 3)]
    return None


def text_size(start):
    """Of a MetaImage, an NRRD or a VTI: their headers are text."""
    for words in (rb"DimSize\s*=\s*([\d ]+)", rb"sizes:\s*([\d ]+)"):
        found = re.search(words, start)
        if found:
            return [int(n) for n in found[1].split()]
    found = re.search(rb'WholeExtent="([-\d ]+)"', start)
    ends = [int(n) for n in found[1].split()] if found else []
    return [b - a + 1 for a, b in zip(ends[::2], ends[1::2])]


def bytes_of(path):
    files = path.iterdir() if path.is_dir() else [path]
    return sum(file.stat().st_size for file in files if file.is_file())


def voxels(path):
    """By the header; DICOM (with one file its whole series) and OpenVDB, whose headers say it elsewhere, are taken to have
    one in every two bytes."""
    try:
        start = b"" if path.is_dir() else head(path)
        if is_dicom(start):
            return bytes_of(path.parent) // 2
        size = nifti_size(start) or text_size(start)
        return math.prod(size) if size else bytes_of(path) // 2
    except (OSError, EOFError, zlib.error):
        return 0


class Job:
    """Cases that go one after the other; called like the first."""

    def __init__(self, cases, cohort):
        self.name, self.cases, self.factor = cases[0].name, cases, cohort.memory
        self.log, self.done, self.failed, self.again = (cohort.folder / f"{self.name}.{ending}"
                                                        for ending in ("log", "done", "failed", "again"))
        self.summaries = [cohort.summary(case) for case in cases]
        self.key = json.dumps([cohort.version, cohort.options, [case.cells for case in cases]], sort_keys=True)

    @property
    def files(self):
        return sorted({str(file) for case in self.cases for file in case.files})

    def memory_mb(self, attempt=1):
        return math.ceil(max(case.memory_mb() for case in self.cases) * self.factor) * 2 ** (attempt - 1)

    def minutes(self, attempt=1):
        return sum(case.minutes() for case in self.cases) * 2 ** (attempt - 1)

    def has_results(self):
        return all(summary.exists() for summary in self.summaries)

    def is_done(self):
        """From these rows and files, as far as their times tell."""
        if not self.done.exists() or self.done.read_text() != self.key or not self.has_results():
            return False
        return all(os.path.getmtime(file) <= self.done.stat().st_mtime for file in self.files)

    def has_failed(self):
        """For good: another attempt would do nothing, as no case of it was killed or lacked memory."""
        return self.failed.exists() and not self.again.exists()


class Cohort:
    """A list, where its derivatives go, and DIR.jobs beside them: what was done, and logs."""

    def __init__(self, path, output, per_job=1, surfseg="surfseg", options="", memory=1.0):
        self.list, self.output, self.surfseg, self.options, self.memory = path, pathlib.Path(output), surfseg, options, memory
        self.folder = pathlib.Path(f"{self.output}.jobs")
        self.cases = read_cases(path)
        self.version = subprocess.run([surfseg, "--version"], stdout=subprocess.PIPE, text=True, check=True).stdout.strip()
        self.jobs = [Job(self.cases[n:n + per_job], self) for n in range(0, len(self.cases), per_job)]

    def job(self, name):
        return next(job for job in self.jobs if job.name == name)

    def batch(self, *words):
        command = [self.surfseg, "batch", str(self.list), "-o", str(self.output), *shlex.split(self.options), *words]
        return subprocess.run(command).returncode

    def summary(self, case):
        return self.output / f"sub-{case.name}/anat/sub-{case.name}_desc-surfseg_surfseg.json"

    def run_case(self, case, threads):
        """0: done; 7: failed, and would again; AGAIN: killed, out of memory, or not written."""
        code = self.batch("--shard", f"{case.row}/{len(self.cases)}", "--threads", str(threads))
        if code == 7 and self.summary(case).exists():
            message = json.loads(self.summary(case).read_text()).get("message", "")
            return AGAIN if message.startswith("out of memory") else 7
        return code if code in (0, 2, 3) else AGAIN

    def run(self, job, attempt, threads):
        """Does what is not done yet; what has failed for good in an earlier attempt is left as it is."""
        known = job.failed.read_text().split() if attempt > 1 and job.failed.exists() else []
        for marker in (job.done, job.failed, job.again):
            marker.unlink(missing_ok=True)
        codes = {case.name: self.run_case(case, threads) if case.name not in known else 7 for case in job.cases}
        failed = [name for name, code in codes.items() if code == 7]
        if failed:
            job.failed.write_text("\n".join(failed) + "\n")
        if AGAIN in codes.values():
            job.again.touch()
        code = max(codes.values())
        if code == 0:
            job.done.write_text(job.key)
        return code

    def check(self):
        """Whether surfseg can use the list at all; else it says what is wrong, and nothing is to be run."""
        return self.batch("--collect", "--quiet")

    def collect(self):
        """Table and page of all. Files that killed jobs have left go here, their folders by surfseg, which sees who uses them."""
        for rest in self.output.glob(".surfseg-*"):
            try:
                if time.time() - rest.stat().st_mtime > LONG_AGO_S:
                    rest.unlink()
            except FileNotFoundError:  # its job has just ended
                pass
        return self.batch("--collect")


def sbatch(*words):
    done = subprocess.run(["sbatch", "--parsable", *words], stdout=subprocess.PIPE, text=True, check=True)
    return done.stdout.strip().split(";")[0]


def classes(jobs, attempt):
    """Jobs that need about the same: an array has one size."""
    out = {}
    for job in jobs:
        out.setdefault(math.ceil(math.log2(job.memory_mb(attempt))), []).append(job)
    return [group[n:n + LARGEST_ARRAY] for _, group in sorted(out.items()) for n in range(0, len(group), LARGEST_ARRAY)]


def still_queued(job):
    done = subprocess.run(["squeue", "--noheader", "-o", "%i", "-j", job], capture_output=True, text=True)
    return done.returncode == 0 and done.stdout.strip() != ""


def submit(cohort, arguments):
    """An array for each class of memory, and after them this again: with more memory, or to collect."""
    attempt, last = arguments.attempt, cohort.folder / "last"
    if attempt == 1:
        if code := cohort.check():
            return code
        if last.exists() and still_queued(last.read_text()):
            print(f"cohort.py: error: {cohort.output}: jobs are still there; wait for job {last.read_text()}", file=sys.stderr)
            return 2
    jobs = [job for job in cohort.jobs if not job.is_done() and not (attempt > 1 and job.has_failed())]
    if not jobs or attempt > 1 + RETRIES:
        return cohort.collect()
    cohort.folder.mkdir(parents=True, exist_ok=True)
    itself = [sys.executable, str(pathlib.Path(__file__).resolve())]
    options = [arguments.list, "-o", arguments.output, "--per-job", str(arguments.per_job), "--surfseg", arguments.surfseg,
               "--threads", str(arguments.threads), "--memory", str(arguments.memory), f"--options={arguments.options}"]
    more, ids = shlex.split(arguments.sbatch), []
    for n, group in enumerate(classes(jobs, attempt), 1):
        names = cohort.folder / f"array-{attempt}-{n}.txt"
        names.write_text("".join(job.name + "\n" for job in group))
        run = shlex.join([*itself, "run", *options, "--attempt", str(attempt), "--job"])
        ids.append(sbatch(
            *more, f"--array=1-{len(group)}%{arguments.at_once}", "--job-name=surfseg", f"--cpus-per-task={arguments.threads}",
            f"--mem={max(job.memory_mb(attempt) for job in group)}", f"--time={max(job.minutes(attempt) for job in group)}",
            f"--output={cohort.folder}/array-{attempt}-{n}-%a.out",
            "--wrap", f'{run} "$(sed -n "${{SLURM_ARRAY_TASK_ID}}p" {shlex.quote(str(names))})"'))
    last.write_text(sbatch(
        *more, f"--dependency=afterany:{':'.join(ids)}", "--job-name=surfseg-collect", "--mem=500", "--time=30",
        f"--output={cohort.folder}/collect-{attempt}.out", "--wrap",
        shlex.join([*itself, "submit", *options, "--at-once", str(arguments.at_once), f"--sbatch={arguments.sbatch}",
                    "--attempt", str(attempt + 1)])))
    print(f"{len(jobs)} of {len(cohort.jobs)} jobs in {len(ids)} array{'s' if len(ids) > 1 else ''}, attempt {attempt}: "
          f"{' '.join(ids)}; then {last.read_text()}")
    return 0


def at_least_one(text):
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"expected 1 or more; got {text}")
    return int(text)


def above_zero(text):
    try:
        if 0 < float(text) < math.inf:
            return float(text)
    except ValueError:
        pass
    raise argparse.ArgumentTypeError(f"expected more than 0; got {text}")


def parser():
    out = argparse.ArgumentParser(description=__doc__)
    verbs = out.add_subparsers(dest="verb", required=True)
    for verb, words in (("needs", "print memory and time of each job"), ("run", "do the cases of one job"),
                        ("submit", "a job array for all that is not done"), ("collect", "write group.tsv and group.html")):
        one = verbs.add_parser(verb, help=words, description=words)
        one.add_argument("list", metavar="LIST", help="as surfseg batch reads it")
        one.add_argument("-o", "--output", required=True, metavar="DIR", help="of all derivatives; logs go to DIR.jobs")
        one.add_argument("--per-job", type=at_least_one, default=1, metavar="N", help="cases in a job [1]")
        one.add_argument("--surfseg", default="surfseg", metavar="PROGRAM", help="[surfseg]")
        one.add_argument("--options", default="", help="of surfseg batch, such as '--preset kidney-ct'")
        one.add_argument("--threads", type=at_least_one, default=1, metavar="N", help="of a job [1]")
        one.add_argument("--memory", type=above_zero, default=1, metavar="F", help="times the estimate [1]")
        one.add_argument("--attempt", type=at_least_one, default=1, metavar="N", help="the second has twice the memory [1]")
        if verb == "run":
            one.add_argument("--job", required=True, metavar="NAME", help="the job's first case")
        if verb == "submit":
            one.add_argument("--at-once", type=at_least_one, default=100, metavar="N", help="jobs at a time [100]")
            one.add_argument("--sbatch", default="", help="further options of sbatch, such as '-p long -A project'")
    return out


def done_by(arguments):
    cohort = Cohort(arguments.list, arguments.output, arguments.per_job, arguments.surfseg, arguments.options,
                    arguments.memory)
    if arguments.verb == "needs":
        print("job\tcases\tmemory_mb\tminutes")
        for job in cohort.jobs:
            print(job.name, len(job.cases), job.memory_mb(arguments.attempt), job.minutes(arguments.attempt), sep="\t")
        return 0
    if arguments.verb == "run":
        cohort.folder.mkdir(parents=True, exist_ok=True)
        return cohort.run(cohort.job(arguments.job), arguments.attempt, arguments.threads)
    return submit(cohort, arguments) if arguments.verb == "submit" else cohort.collect()


def main():
    try:
        return done_by(parser().parse_args())
    except OSError as error:
        print(f"cohort.py: error: {error.filename}: {error.strerror}", file=sys.stderr)
        return 3
    except subprocess.CalledProcessError as error:  # what it says itself is printed
        print(f"cohort.py: error: {error.cmd[0]} ended with {error.returncode}", file=sys.stderr)
        return 3


if __name__ == "__main__":
    sys.exit(main())
