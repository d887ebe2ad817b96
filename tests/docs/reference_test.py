"""The API reference: Doxygen has nothing to say against any header that is installed, and each has a page."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest
from xml.etree import ElementTree

SOURCE = pathlib.Path(os.environ["SURFSEG_SOURCE"])
DOXYFILE = pathlib.Path(os.environ["SURFSEG_DOXYFILE"])


def headers():
    """As cmake/SurfsegInstall.cmake installs them."""
    return [path for library in ("libsurf", "libcurve") for path in sorted((SOURCE / library).rglob("*.h"))
            if "detail" not in path.parts]


def doxygen(folder, **settings):
    lines = [f"{key} = {value}" for key, value in {"OUTPUT_DIRECTORY": f'"{folder}"', **settings}.items()]
    return subprocess.run(["doxygen", "-"], input="\n".join([DOXYFILE.read_text(), *lines]), text=True, capture_output=True)


def brief(element):
    return "".join(element.find("briefdescription").itertext())


class Reference(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="surfseg-docs-"))

    def tearDown(self):
        shutil.rmtree(self.folder)

    def test_no_header_gives_a_warning_and_each_has_a_page(self):
        done = doxygen(self.folder, GENERATE_HTML="NO", GENERATE_XML="YES")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        index = (self.folder / "xml/index.xml").read_text()
        self.assertGreater(len(headers()), 100)
        for path in headers():
            self.assertIn(f"<name>{path.name}</name>", index)
        self.assertNotIn("/detail/", index)
        page = ElementTree.parse(self.folder / "xml/stiffness_8h.xml").getroot()[0]
        self.assertIn("the discrete curvature", brief(page), "the comment at the file's head is lost")
        names = ElementTree.parse(self.folder / "xml/namespacesurf_1_1fem.xml")
        [function] = [f for f in names.iter("memberdef") if f.find("name").text == "normal_stiffness"]
        self.assertIn("(n_i . n_j) A_ij", brief(function), "a product has ended a sentence")

    def test_a_comment_that_names_another_parameter_is_found(self):
        header = SOURCE / "libsurf/fem/stiffness.h"
        broken = self.folder / "stiffness.h"
        text = header.read_text()
        self.assertIn("@param alpha", text)
        broken.write_text(text.replace("@param alpha", "@param beta", 1))
        done = doxygen(self.folder, INPUT=f'"{broken}"', USE_MDFILE_AS_MAINPAGE="", GENERATE_HTML="NO", GENERATE_XML="YES")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("argument 'beta'", done.stderr)


if __name__ == "__main__":
    if shutil.which("doxygen") is None:
        print("skipped: doxygen is missing")
        sys.exit(77)
    unittest.main()
