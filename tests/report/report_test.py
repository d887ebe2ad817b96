"""The report of a case in Chromium: opened from the disk, turned by hand, without a word to the network or the console."""
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "studio"))
from browser import BrowserError, run_tests  # noqa: E402

PROGRAM = os.environ["SURFSEG_PROGRAM"]


def expect(condition, words):
    if not condition:
        raise BrowserError(words)


def surfseg(folder, *words, code=0):
    done = subprocess.run([PROGRAM, *words], cwd=folder, capture_output=True, text=True)
    expect(done.returncode == code, f"{words[0]} ends with {done.returncode}: {done.stderr[-500:]}")


def stage(browser):
    """The pixels of the viewer."""
    browser.frame()
    return browser.js("document.getElementById('solid').toDataURL()")


def opened(browser, path):
    browser.open(path.as_uri())
    browser.until("document.readyState === 'complete' && document.getElementById('no-viewer')")
    browser.js("document.getElementById('viewer').scrollIntoView()")
    browser.frame()


def expect_quiet(browser):
    asked = [a for a in browser.requests() if not a.startswith(("data:", "file:", "about:"))]
    expect(not asked, f"it asked the network for {asked}")
    expect(not browser.log(), f"the console says {browser.log()}")


def a_report_is_turned_by_hand(browser):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        surfseg(folder, "phantom", "torus", "--size", "40", "--spacing", "1", "-o", "torus.nii.gz")
        surfseg(folder, "segment", "torus.nii.gz", "--seed", "12,0,0", "-o", "torus.stl", "--report", "case.html")
        opened(browser, folder / "case.html")
        expect(browser.js("!document.getElementById('viewer').hidden && document.getElementById('no-viewer').hidden"),
               "the viewer is not there")
        first = stage(browser)
        colours = browser.js("""(() => { const c = document.createElement('canvas'), s = document.getElementById('solid');
            c.width = s.width; c.height = s.height; const d = c.getContext('2d'); d.drawImage(s, 0, 0);
            return new Set(new Uint32Array(d.getImageData(0, 0, c.width, c.height).data.buffer)).size })()""")
        expect(colours > 50, f"only {colours} colours: no shaded surface")
        x, y = browser.js("(() => { const r = document.getElementById('solid').getBoundingClientRect();"
                          " return [r.left + r.width / 2, r.top + r.height / 2] })()")
        browser.drag((x, y), (x + 120, y + 60))
        second = stage(browser)
        expect(second != first, "a drag has changed no pixel")
        browser.wheel(x, y, -300)
        third = stage(browser)
        expect(third != second, "the wheel has changed no pixel")
        browser.press("#tools button")
        expect(stage(browser) == first, "'Front' does not lead back")
        for value in ("deviation", "edge"):
            browser.js(f"(() => {{ const s = document.querySelector('#tools select'); s.value = '{value}';"
                       " s.dispatchEvent(new Event('input')) })()")
            expect(stage(browser) != first, f"the colours by {value} are not to be seen")
        broken = browser.js("[...document.images].filter((i) => !i.naturalWidth).length")
        expect(not broken and browser.js("document.images.length") >= 2, "a picture cannot be shown")
        expect_quiet(browser)
        browser.picture("report")


def large_surfaces_are_thinned_for_the_page_alone(browser):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        surfseg(folder, "phantom", "ball", "--size", "48", "--spacing", "1", "-o", "ball.nii.gz")
        surfseg(folder, "segment", "ball.nii.gz", "--seed", "0,0,0", "--edge-length", "0.2mm", "--coarseness", "1",
                "--initial-ball", "0,0,0,13mm", "--energy", "area:weight=0.001", "--energy", "window:mean=1,half-width=0.5",
                "--max-iterations", "1", "-o", "ball.stl", "--report", "case.html", code=5)  # at its limit
        n = (os.path.getsize(folder / "ball.stl") - 84) // 50
        size = os.path.getsize(folder / "case.html")
        expect(n > 100_000, f"only {n} triangles")
        expect(size < 5_000_000, f"{size} bytes")
        opened(browser, folder / "case.html")
        shown = browser.js("JSON.parse(document.getElementById('scene').textContent)"
                           ".map((o) => o.bits === 16 ? atob(o.triangles).length / 6 : atob(o.triangles).length / 12)[0]")
        expect(90_000 < shown <= 100_001, f"{shown} triangles are shown")
        expect(browser.js("document.getElementById('viewer').textContent.includes('in place of " + str(n) + "')"),
               "the page does not say that it shows less")
        expect(browser.js("[...document.querySelectorAll('tr')].some((r) => r.textContent === 'Triangles' +"
                          f" String(Number(({n}).toPrecision(6))))"), "the table has another number of triangles")
        expect_quiet(browser)


def a_batch_leads_to_its_reports(browser):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        rows = ["name\tscan\tclicks"]
        for n, size in enumerate((24, 28)):
            surfseg(folder, "phantom", "ball", "--size", str(size), "--spacing", "1", "-o", f"{n}.nii.gz")
            rows.append(f"case{n}\t{n}.nii.gz\t0,0,0")
        (folder / "list.tsv").write_text("\n".join(rows) + "\n")
        surfseg(folder, "batch", "list.tsv", "-o", "out")
        browser.open((folder / "out/group.html").as_uri())
        browser.until("document.querySelector('circle')")
        # A click where the dot is.
        x, y = browser.js("(() => { const c = document.querySelector('circle'); c.scrollIntoView({block: 'center'});"
                          " const r = c.getBoundingClientRect(); return [r.left + r.width / 2, r.top + r.height / 2] })()")
        browser.click(x, y)
        for _ in range(20):  # a question asked while the page goes is not answered
            try:
                browser.until("document.getElementById('solid')", limit=10)
                break
            except BrowserError as error:
                if "navigated" not in str(error):
                    raise
        address = browser.js("location.pathname")
        expect(address.endswith("sub-case0/figures/sub-case0_desc-surfseg_report.html"), f"it leads to {address}")
        expect(browser.js("!document.body.textContent.includes('.partial')"), "a folder that nobody sees is named")
        expect_quiet(browser)


if __name__ == "__main__":
    sys.exit(run_tests([a_report_is_turned_by_hand, large_surfaces_are_thinned_for_the_page_alone, a_batch_leads_to_its_reports]))
