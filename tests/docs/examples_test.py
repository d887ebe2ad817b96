"""The examples of the README and docs/*.md that make their own data (by `surfseg phantom` or `curveseg phantom`), as they are printed,
one page after the other in an empty folder: each ends with 0, or with what the page says ("ends with 7")."""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).parents[2]
PROGRAMS = os.environ["SURFSEG_PROGRAMS"]


def blocks_of(page):
    """(number of its first line, commands, exit code) of each indented block that begins by making a phantom."""
    lines = page.read_text(encoding="utf-8").splitlines()
    number = 0
    while number < len(lines):
        first = number
        while number < len(lines) and lines[number].startswith("    "):
            number += 1
        commands = "\n".join(line[4:] for line in lines[first:number])
        if re.search(r"^\s*(surfseg|curveseg) phantom ", commands, re.M) and first > 0 and not lines[first - 1].startswith("    "):
            behind = "\n".join(lines[number:number + 30]).split("\n#")[0]
            says = re.search(r"\bends with (\d+)", behind)
            yield first + 1, commands, int(says.group(1)) if says else 0
        number = max(number, first + 1)


def main():
    environment = dict(os.environ, PATH=PROGRAMS + os.pathsep + os.environ["PATH"])
    n_failed = n_run = 0
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        with tempfile.TemporaryDirectory() as folder:
            for line, commands, expected in blocks_of(page):
                # Under the address sanitizer: a display's driver leaks, and is unloaded before leaks are looked for.
                draws = "ASAN_OPTIONS=detect_leaks=0 xvfb-run" if shutil.which("xvfb-run") else "true"
                commands = re.sub(r"^xvfb-run\b", draws, commands, flags=re.M)
                ended = subprocess.run(["bash", "-e", "-c", commands], cwd=folder, env=environment, text=True,
                                       stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
                n_run += 1
                print("%s:%d: ended with %d, expected %d" % (page.relative_to(ROOT), line, ended.returncode, expected), flush=True)
                if ended.returncode != expected:
                    n_failed += 1
                    print(commands, ended.stdout, sep="\n")
    if n_run < 4:
        sys.exit("found only %d examples" % n_run)
    sys.exit(1 if n_failed else 0)


if __name__ == "__main__":
    main()
