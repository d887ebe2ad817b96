#!/usr/bin/python3
"""The studio in a real browser, with the true server: browser_test.py [--screenshots FOLDER] [name ...]

Real mouse events on volumes of our own making. Says "skipped" and ends with 77 where Chromium is missing.
"""
import gzip
import json
import os
import shutil
import struct
import subprocess
import sys
import time

from browser import SHIFT, run_tests
from studio import Studio, can_mount, folder_with, mounted, phantom

DEMO_SCAN = "/usr/share/mricron/templates/ch2.nii.gz"
# Columns of direction matrices: where the indices run to.
AFFINES = {"oblique": "0.866,-0.433,0.25,0.5,0.75,-0.433,0,0.5,0.866", "sheared": "1,0.3,0,0,1,0.2,0,0,1",
           "mirrored": "-1,0,0,0,1,0,0,0,1", "anisotropic": "1,0,0,0,1,0,0,0,1"}


def check(condition, words):
    if not condition:
        raise AssertionError(words)


def open_page(browser, studio):
    browser.open(studio.address)
    browser.until("window.studio && studio.ready", 120)
    browser.until("studio.state.volume && !studio.state.job", 120)
    if browser.js("!document.getElementById('hint').hidden"):
        browser.press("#hint-close")
    browser.frame()


def place(browser, pane, across=0.5, down=0.5):
    box = browser.js(f"studio.pane('{pane}')")
    return round(box["left"] + across * box["width"]), round(box["top"] + down * box["height"])


def done(browser, limit=240):
    browser.until("studio.state.objects[0]?.measures && !studio.state.job", limit)
    browser.frame()


class Voxels:
    """The volume as the page gets it: NIfTI-1 read here by its header, so that nothing of ours is used."""

    def __init__(self, data):
        data = gzip.decompress(data)
        self.size = struct.unpack("<3h", data[42:48])
        self.kind = {2: "B", 4: "h"}[struct.unpack("<h", data[70:72])[0]]
        slope, intercept = struct.unpack("<2f", data[112:120])
        self.affine = [struct.unpack("<4f", data[280 + 16 * r:296 + 16 * r]) for r in range(3)]
        values = memoryview(data[352:]).cast(self.kind)
        self.at = lambda i, j, k: intercept + slope * values[i + self.size[0] * (j + self.size[1] * k)]

    def index(self, point):
        m, right = [row[:3] for row in self.affine], [p - row[3] for p, row in zip(point, self.affine)]

        def det(a):
            return (a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) - a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0])
                    + a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]))

        return [round(det([[right[r] if c == k else m[r][c] for c in range(3)] for r in range(3)]) / det(m)) for k in range(3)]


def clicks_land_in_the_voxel_that_is_seen(browser):
    """Six on each kind of affine: the grey under the mouse is that of the voxel that the server is told."""
    for name, direction in AFFINES.items():
        spacing = "0.8,1,2.4" if name == "anisotropic" else "1,1.1,1.3"
        folder = folder_with(("v.nii.gz", "torus", "--size", "40,48,32", "--spacing", spacing, "--direction=" + direction,
                              "--noise", "0.3", "--random-seed", "7"))
        with Studio(folder, "v.nii.gz") as studio:
            open_page(browser, studio)
            if browser.js("document.getElementById('smooth').checked"):
                browser.press("#smooth")
            browser.key("x")  # without the crosshair's lines
            voxels = Voxels(studio.get("/api/volume.nii.gz"))
            low, high = studio.state()["volume"]["window"]
            n = 0
            for pane, across, down, modifiers in (("axial", .55, .45, 0), ("axial", .42, .61, SHIFT), ("coronal", .5, .37, 0),
                                                  ("coronal", .61, .58, SHIFT), ("sagittal", .44, .56, 0), ("sagittal", .63, .42, SHIFT)):
                x, y = place(browser, pane, across, down)
                if not browser.js("studio.view.hidden.length"):
                    browser.key("h")  # outlines and marks must not be what is seen
                browser.hover(x, y)
                browser.frame()
                time.sleep(0.1)
                seen = browser.pixel(x, y)
                browser.click(x + 0.5, y + 0.5, modifiers)
                n += 1
                browser.until(f"studio.state.objects[0].clicks.length === {n} || document.querySelector('.alert')")
                clicks = studio.state()["objects"][0]["clicks"]
                check(len(clicks) == n, f"{name} {pane}: {browser.js('document.querySelector(`.alert`)?.textContent')}")
                index = voxels.index(clicks[-1]["point"])
                grey = 255 * (min(max(voxels.at(*index), low), high) - low) / (high - low)
                check(abs(seen[0] - grey) <= 3, f"{name} {pane}: {seen[0]} is seen, voxel {index} has {grey:.0f}")
                check(clicks[-1]["side"] == ("outside" if modifiers else "inside"), f"{name} {pane}: {clicks[-1]['side']}")
                studio.do("stop")
        shutil.rmtree(folder)


def a_session_from_the_first_click_to_the_files(browser):
    """On the demo's scan if it is installed, else on a phantom: what is exported is what the command line repeats."""
    top = folder_with()
    folder = os.path.join(top, "scans")  # its name is seen in the pictures
    os.mkdir(folder)
    if os.path.exists(DEMO_SCAN):
        os.symlink(DEMO_SCAN, os.path.join(folder, "scan.nii.gz"))
        inside, more, outside = (10, -10, 22), (-10, -12, 22), (0, 40, 40)
    else:
        phantom(folder, "scan.nii.gz", "separate-balls", "--size", "64", "--noise", "0.05")
        inside, more, outside = (-0.5, 0, 0), (0.5, 0, 0), (0, 0, 0)
    with Studio(folder) as studio:
        browser.open(studio.address)
        browser.until("window.studio && !document.getElementById('files').hidden", 60)
        browser.picture("1-files")
        browser.press("#files-list button.file")
        open_page(browser, studio)
        browser.picture("2-open")

        def click(point, modifiers=0):
            browser.js(f"studio.lookAt({list(point)})")
            browser.frame()
            at = browser.js(f"studio.position('axial', {list(point)})")
            browser.click(*at, modifiers)

        begin = time.time()
        click(inside)
        browser.until("studio.framesShown > 0", 120)
        first = time.time() - begin
        browser.until("/evolving, step/.test(document.getElementById('job').textContent) || !studio.state.job", 120)
        browser.key("Escape")  # stays where it is, if it has not ended by now
        done(browser)
        browser.picture("3-evolving")
        browser.key("g")  # and on
        browser.until("studio.state.objects[0].outcome === 'converged' && !studio.state.job", 240)
        browser.frame()
        print(f"    first outline after {first:.2f} s, surface after {time.time() - begin:.2f} s")
        browser.picture("4-surface")
        one = studio.state()["objects"][0]
        click(outside, SHIFT)
        browser.until("studio.state.objects[0].clicks.length === 2")
        done(browser)
        browser.picture("5-outside")
        click(more)
        browser.until("studio.state.objects[0].clicks.length === 3")
        done(browser)
        browser.picture("6-inside")
        browser.press("#undo")
        browser.until("studio.state.objects[0].clicks.length === 2")
        browser.press("#undo")
        browser.until("studio.state.objects[0].clicks.length === 1")
        done(browser)
        check(studio.state()["objects"][0]["measures"] == one["measures"], "undone to what was")
        browser.press("#redo")
        browser.until("studio.state.objects[0].clicks.length === 2")
        done(browser)
        browser.key("e")
        browser.until("document.getElementById('export').open")
        browser.picture("7-export")
        browser.js("(() => { const i = document.getElementById('export-name'); i.value = 'object.stl'; i.dispatchEvent(new Event('input')); })()")
        browser.press("#export-go")
        browser.until("document.querySelector('.result.good')")
        browser.press("[data-key=kind-labels]")
        browser.js("(() => { const i = document.getElementById('export-name'); i.value = 'labels.nii.gz'; i.dispatchEvent(new Event('input')); })()")
        browser.press("#export-go")
        browser.until("document.querySelector('.result.good')?.textContent.includes('labels')")
        browser.key("Escape")
        browser.until("!document.getElementById('export').open")
        browser.press("#tab-options")
        browser.picture("8-options")
        browser.key("?")
        browser.until("document.getElementById('help').open")
        browser.picture("9-help")
        browser.key("Escape")
        browser.key("t")
        browser.press("#tab-objects")
        browser.js("(() => { const s = document.querySelector('.mesh-colour select'); s.value = 'deviation'; s.dispatchEvent(new Event('change')); })()")
        browser.js("new Promise(r => setTimeout(r, 900))")
        browser.picture("10-dark")
        command = json.loads(studio.get("/api/command?object=1"))["text"].split(" -o ")[0]
    program = os.environ["SURFSEG_PROGRAM"]
    subprocess.run(f"{command.replace('surfseg', program, 1)} -o again.stl --mask again.nii.gz", shell=True, check=True,
                   cwd=folder, capture_output=True)
    for ours, theirs in (("object.stl", "again.stl"), ("labels.nii.gz", "again.nii.gz")):
        with open(os.path.join(folder, ours), "rb") as a, open(os.path.join(folder, theirs), "rb") as b:
            check(a.read() == b.read(), f"{ours}: the bytes of the command line")
    shutil.rmtree(top)


def a_full_disk_is_told_where_one_exports(browser):
    if not can_mount():
        print("    skipped: no mounts of one's own here")
        return
    source, folder = folder_with(("balls.nii.gz", "separate-balls", "--size", "40", "--noise", "0.05")), folder_with()
    with Studio(folder, "balls.nii.gz", before=mounted(source, room=5 * 4096)) as studio:
        open_page(browser, studio)
        browser.js("studio.lookAt([-0.5, 0, 0])")
        browser.frame()
        browser.click(*browser.js("studio.position('axial', [-0.5, 0, 0])"))
        done(browser)
        browser.key("e")
        browser.until("document.getElementById('export').open")
        before = studio.listed()
        browser.press("#export-go")
        browser.until("document.querySelector('.result.bad')")
        told = browser.js("document.querySelector('.result').textContent")
        check("No space left on device" in told and ".stl" in told, told)
        check(studio.listed() == before, "nothing is left of it")
        browser.picture("disk-full")
        browser.key("Escape")
        browser.until("!document.getElementById('export').open")
        check(browser.js("studio.state.objects[0].has_surface"), "the surface is still there")
    shutil.rmtree(source)
    shutil.rmtree(folder)


TESTS = [clicks_land_in_the_voxel_that_is_seen, a_session_from_the_first_click_to_the_files, a_full_disk_is_told_where_one_exports]


if __name__ == "__main__":
    sys.exit(run_tests(TESTS))
