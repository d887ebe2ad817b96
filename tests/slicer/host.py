"""Slicer's part, played: from a module's description and what its window holds to the call, as
vtkSlicerCLIModuleLogic makes it, and from the program's output to progress and values."""
import os
import re
import subprocess
import xml.etree.ElementTree as ElementTree

PROGRAM = os.environ.get("SURFSEG_SLICER", "")
SURFSEG = os.environ.get("SURFSEG_PROGRAM", "")
ALWAYS_PASSED = ("integer", "float", "double", "string-enumeration")


class Parameter:
    def __init__(self, element):
        text = lambda name: (element.findtext(name) or "").strip()  # noqa: E731
        self.tag = element.tag
        self.name, self.default, self.channel = text("name"), text("default"), text("channel")
        self.flag, self.index = text("longflag").lstrip("-"), text("index")
        self.extensions = element.get("fileExtensions", "").split(",")
        self.space = element.get("coordinateSystem", "")
        self.choices = [child.text for child in element.findall("element")]

    def is_return(self):
        return self.channel == "output" and not self.flag and not self.index


def parameters(xml):
    assert xml.startswith("<?xml "), xml[:80]
    names = ("label", "description")
    return [Parameter(element) for group in ElementTree.fromstring(xml).findall("parameters")
            for element in group if element.tag not in names]


def point_text(point, space):
    """Of a point in the scene (RAS); a C++ stream has six digits."""
    signs = (-1, -1, 1) if space == "lps" else (1, 1, 1)
    return ",".join("%g" % (sign * value) for sign, value in zip(signs, point))


def call(xml, values, return_file=None):
    """The arguments. `values` by name: points in RAS, names of files, texts, numbers, booleans."""
    words, indexed = [], {}
    table = parameters(xml)
    unknown = set(values) - {p.name for p in table}
    assert not unknown, unknown
    if any(p.is_return() for p in table):
        words += ["--returnparameterfile", return_file]
    for p in table:
        value = values.get(p.name)
        if p.index:
            indexed[int(p.index)] = str(value if value is not None else p.default)
        elif not p.flag:
            continue
        elif p.tag in ALWAYS_PASSED:
            words += ["--" + p.flag, str(value if value is not None else p.default)]
        elif p.tag == "boolean":
            words += ["--" + p.flag] if value else []
        elif p.tag == "point":
            for point in value or []:
                words += ["--" + p.flag, point_text(point, p.space)]
        elif value:
            words += ["--" + p.flag, str(value)]
    return words + [indexed[n] for n in sorted(indexed)]


def run(words, folder, program=None, **more):
    return subprocess.run([program or PROGRAM, *words], cwd=folder, text=True, capture_output=True,
                          timeout=120, **more)


def progress(out):
    return [float(text) for text in re.findall(r"<filter-progress>([^<]*)</filter-progress>", out)]


def without_tags(out):
    """What Slicer shows as the output: inner tags go first, then those they were in."""
    for name in ("progress", "stage-progress", "name", "comment", "time", "start", "end"):
        out = re.sub(rf"<filter-{name}>[^<]*</filter-{name}>[ \t\n\r]*", "", out)
    return out


def return_values(path):
    with open(path) as file:
        return dict((part.strip() for part in line.split("=", 1)) for line in file)
