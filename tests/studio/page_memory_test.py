#!/usr/bin/python3
"""Memory of the page over 200 clicks and 50 undos, by real mouse events: page_memory_test.py [CLICKS [UNDOS]]

Prints the page's heap after a collection of garbage, and what is resident of the browser's renderer, eight times. Fails where one of them, or the
server's memory, is at the end more than a tenth above that after a quarter of the clicks. Says "skipped" and ends with 77 where Chromium is missing.
"""
import math
import os
import random
import shutil
import sys

from browser import CTRL, SHIFT, Browser, BrowserError, find_browser
from studio import Studio, folder_with

WARM = 0.25  # of the clicks: by then all code of the page has run


def renderer_mb(browser):
    """Of the largest renderer: what is resident."""
    most = 0
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{pid}/cmdline") as file:
                words = file.read()
            if browser.folder in words and "--type=renderer" in words:
                with open(f"/proc/{pid}/status") as file:
                    most = max(most, *(int(line.split()[1]) / 1024 for line in file if line.startswith("VmRSS")))
        except OSError:
            pass  # it has ended
    return most


def heap_mb(browser):
    for _ in range(2):
        browser("HeapProfiler.collectGarbage")
    return browser("Runtime.getHeapUsage")["usedSize"] / 2**20


def rest(browser):
    browser.until("!studio.state.job", 240)
    browser.frame()


def measure(browser, studio, what):
    now = heap_mb(browser), renderer_mb(browser), studio.memory_mb()
    print(f"{what}: heap {now[0]:.2f} MB, renderer {now[1]:.0f} MB, server {now[2]:.0f} MB", flush=True)
    return now


def run(n_clicks, n_undos):
    """Clicks all round the surface of a ball, in turn inside and outside, each followed by its evolution."""
    folder = folder_with(("ball.nii.gz", "ball", "--size", "64", "--noise", "0.1"))
    draw = random.Random(5)
    with Studio(folder, "ball.nii.gz") as studio, Browser() as browser:
        browser("Network.disable")  # else the renderer keeps what the page has been sent, for the tools
        browser.open(studio.address)
        browser.until("window.studio && studio.ready && studio.state.volume && !studio.state.job", 120)
        if browser.js("!document.getElementById('hint').hidden"):
            browser.press("#hint-close")
        warm, n_made, n_missed = None, 0, 0
        while n_made < n_clicks:
            outside = n_made % 2 == 1
            z, angle = draw.uniform(-1, 1), draw.uniform(0, 2 * math.pi)
            radius = draw.uniform(0.7, 0.95) if outside else draw.uniform(0, 0.5)  # the ball's is 0.6
            across = radius * math.sqrt(1 - z * z)
            point = [across * math.cos(angle), across * math.sin(angle), radius * z]
            browser.js(f"studio.lookAt({point})")
            browser.frame()
            browser.click(*browser.js(f"studio.position('axial', {point})"), SHIFT if outside else 0)
            try:
                browser.until(f"studio.state.objects[0]?.clicks.length === {n_made + 1}", 5)
            except BrowserError:
                n_missed += 1  # it was refused, or on the mark of an earlier one, which it selects
                if n_missed > n_clicks:
                    raise
                continue
            n_made += 1
            rest(browser)
            if n_made % max(1, n_clicks // 8) == 0:
                now = measure(browser, studio, f"{n_made} clicks")
                warm = warm or (now if n_made >= WARM * n_clicks else None)
        for _ in range(n_undos):
            browser.key("z", CTRL)
            rest(browser)
        last = measure(browser, studio, f"after {n_undos} undos")
    shutil.rmtree(folder)
    grown = [100 * (after / before - 1) for before, after in zip(warm, last)]
    print("grown since a quarter of the clicks: heap %+.1f %%, renderer %+.1f %%, server %+.1f %%" % tuple(grown))
    return 0 if max(grown) < 10 else 1


if __name__ == "__main__":
    if not find_browser():
        print("skipped: Chromium missing")
        sys.exit(77)
    sys.exit(run(*([int(word) for word in sys.argv[1:]] or [200, 50])))
