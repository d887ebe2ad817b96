"""The tables of docs/*.md against what their studies print now: see reprint-docs.sh."""
import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BINARIES = ROOT / "build/release/bin"
# Page, and the study with its words; {scratch} is a folder for pictures.
STUDIES = [
    ("energy-derivatives", ["derivative_study"]),
    ("energies", ["model_study", "{scratch}"]),
    ("synthetic-study", ["synthetic_study"]),
    ("real-images", ["real_images_study"]),
    ("flows", ["flow_study"]),
    ("flows", ["quadratic_velocities"]),
    ("topology", ["topology_study"]),
    ("mumford-shah-volumes", ["mumford_shah_volumes"]),
    ("mumford-shah", ["mumford_shah_study", "--pictures", "{scratch}"]),
    ("mumford-shah", ["multilevel_study"]),
    ("adaptivity", ["adaptivity_study", "{scratch}"]),
    ("phantoms", ["phantom_study"]),
    ("phantoms", ["phantom_study", "sizes"]),
    ("method", ["locate_study"]),
]
NUMBER = re.compile(r"[-+]?(?:\d[\d,]*\.?\d*|\.\d+)(?:e[-+]?\d+)?")
CLOCK = re.compile(r"(?:^|[ ,(])(?:s|ms|seconds|time|MB)$")  # the end of columns that depend on the machine
RELATIVE, DIGITS = 0.05, 2  # of a number, or so many units of its last digit behind the point
ROUNDING = 1e-12


def tables_of(lines):
    """[(number of the first line, [cells of a row, ...])]; the head is the first row, the line of dashes below it is left out."""
    out, rows, first, is_table = [], [], 0, False
    for n, line in enumerate([*lines, ""]):
        if line.strip().startswith("|"):
            if not rows:
                first = n
            cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
            if all(re.fullmatch(r":?-+:?", cell) for cell in cells):
                if len(rows) > 1 and is_table:  # one right after another
                    out.append((first, rows[:-1]))
                    rows, first = rows[-1:], n - 1
                is_table = len(rows) == 1
            else:
                rows.append(cells)
        elif rows:
            if is_table:
                out.append((first, rows))
            rows, is_table = [], False
    return out


def value(text):
    return float(text.replace(",", ""))


def unit(text):
    """Of the last digit."""
    mantissa, _, exponent = text.replace(",", "").partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def fraction(a, b):
    """Of the last digit, but 0 for whole numbers: counts of parts are not rounded."""
    return max(unit(text) if unit(text) < 1 else 0 for text in (a, b))


def are_alike(a, b):
    """The same words, and numbers within the tolerance."""
    if NUMBER.sub("#", a) != NUMBER.sub("#", b):
        return False
    return all(abs(value(x) - value(y)) <= max(RELATIVE * abs(value(x)), DIGITS * fraction(x, y), ROUNDING)
               for x, y in zip(NUMBER.findall(a), NUMBER.findall(b)))


def differences(page, printed):
    """Words for each cell that is another one."""
    head, out = printed[0], []
    if len(page) != len(printed):
        return [f"{len(page) - 1} rows, {len(printed) - 1} are printed"]
    for row, (old, new) in enumerate(zip(page[1:], printed[1:]), 1):
        for column, (a, b) in enumerate(zip(old, new)):
            if not CLOCK.search(head[min(column, len(head) - 1)]) and not are_alike(a, b):
                out.append(f"row {row}, {head[min(column, len(head) - 1)] or column}: {a or 'nothing'}, now {b or 'nothing'}")
        if len(old) != len(new):
            out.append(f"row {row}: {len(old)} cells, now {len(new)}")
    return out


def written(table, lines):
    """The page with the rows of one of its tables, which has as many."""
    first, rows = table
    lines = list(lines)
    for n, row in enumerate(rows):
        line = lines[first + n + (n > 0)]  # after the head comes the line of dashes
        lines[first + n + (n > 0)] = line[:len(line) - len(line.lstrip())] + "| " + " | ".join(row) + " |"
    return lines


def check(name, words, binaries, writes):
    scratch = tempfile.mkdtemp(prefix="surfseg-docs-")
    command = [str(binaries / words[0]), *(word.replace("{scratch}", scratch) for word in words[1:])]
    if not os.environ.get("DISPLAY") and shutil.which("xvfb-run"):
        command = ["xvfb-run", "-a", *command]
    run = subprocess.run(command, capture_output=True, text=True)
    shutil.rmtree(scratch)
    label = f"{name}.md, {' '.join(words[:2] if '{' not in words[-1] else words[:1])}"
    if run.returncode != 0:
        print(f"{label}: code {run.returncode}: {run.stderr.strip()[:300]}")
        return False
    path = ROOT / "docs" / f"{name}.md"
    is_good, printed = True, tables_of(run.stdout.splitlines())
    if not printed:
        print(f"{label}: no table is printed")
        return False
    for _, rows in printed:
        lines = path.read_text().splitlines()
        # Of several with this head the one that is most like it.
        candidates = [(first, page) for first, page in tables_of(lines) if page[0] == rows[0]]
        if not candidates:
            print(f"{label}: the page has no table | {' | '.join(rows[0])} |")
            is_good = False
            continue
        first, page = min(candidates, key=lambda table: len(differences(table[1], rows)) + 1000 * (len(table[1]) != len(rows)))
        found = differences(page, rows)
        print(f"{label}: line {first + 1}, {len(rows) - 1} rows: {'within the tolerance' if not found else f'{len(found)} differences'}", flush=True)
        for one in found:
            print(f"  {one}")
        is_good &= not found
        if found and writes and len(page) == len(rows):
            path.write_text("\n".join(written((first, rows), lines)) + "\n")
    return is_good


def main():
    parser = argparse.ArgumentParser(prog="reprint-docs.sh", description="Tables of docs/*.md against what their studies print now.")
    parser.add_argument("pages", nargs="*", metavar="PAGE", help=f"of {', '.join(dict.fromkeys(name for name, _ in STUDIES))}; none: all")
    parser.add_argument("--binaries", type=Path, default=BINARIES, help="folder of the studies [build/release/bin]")
    parser.add_argument("--write", action="store_true", help="write what is printed into the page, where it has as many rows")
    arguments = parser.parse_args()
    unknown = set(arguments.pages) - {name for name, _ in STUDIES}
    if unknown:
        parser.error(f"no study prints tables of {', '.join(sorted(unknown))}")
    wanted = [(name, words) for name, words in STUDIES if not arguments.pages or name in arguments.pages]
    if arguments.binaries == BINARIES:  # other builds leave the studies as they are
        targets = dict.fromkeys(words[0] for _, words in wanted)
        if subprocess.run(["cmake", "--build", BINARIES.parent, "--target", *targets], stdout=subprocess.DEVNULL).returncode:
            parser.error(f"{BINARIES.parent}: the studies cannot be built; cmake --preset release first")
    missing = [words[0] for _, words in wanted if not (arguments.binaries / words[0]).exists()]
    if missing:
        parser.error(f"{arguments.binaries}: {', '.join(missing)} missing: build the target studies first")
    return 0 if all([check(name, words, arguments.binaries, arguments.write) for name, words in wanted]) else 1


if __name__ == "__main__":
    sys.exit(main())
