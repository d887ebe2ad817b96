#!/usr/bin/python3
"""The page in a real browser, against mock_server.mjs: python3 page_test.py [--screenshots FOLDER] [name ...]

Says "skipped" and ends with 77 where Chromium or Node is missing. Needs dist/ (npm run build).
"""
import json
import os
import shutil
import subprocess
import sys
import time
import urllib.request

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "..", "..", "..", "tests", "studio"))
from browser import CTRL, SHIFT, run_tests  # noqa: E402



class Server:
    def __init__(self, *arguments):
        self.process = subprocess.Popen(["node", os.path.join(HERE, "mock_server.mjs"), *arguments], stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().strip()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()

    def get(self, path):
        with urllib.request.urlopen(self.address + path, timeout=20) as answer:
            return json.load(answer)

    def received(self, action):
        return [r for r in self.get("mock/received") if r.get("action") == action or action in r]


def check(condition, words):
    if not condition:
        raise AssertionError(words)


def open_page(browser, server, ready="window.studio && studio.ready"):
    browser.open(server.address)
    browser.until(ready)
    browser.frame()


def place(browser, pane, across=0.5, down=0.5):
    box = browser.js(f"studio.pane('{pane}')")
    # Whole pixels: some events have no others.
    return round(box["left"] + across * box["width"]), round(box["top"] + down * box["height"])


def done(browser, object_number=0):
    browser.until(f"studio.state.objects[{object_number}]?.measures && !studio.state.job", 20)
    browser.frame()


def segment_something(browser, server):
    """The page with one object, from a click into the axial slice."""
    open_page(browser, server)
    browser.click(*place(browser, "axial"))
    done(browser)


def voxel(index_to_world, point):
    """Index of a point: Cramer's rule, so that nothing of the page is used."""
    m = [row[:3] for row in index_to_world[:3]]
    right = [p - row[3] for p, row in zip(point, index_to_world)]

    def det(a):
        return (a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) - a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0])
                + a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]))

    return [det([[right[r] if c == k else m[r][c] for c in range(3)] for r in range(3)]) / det(m) for k in range(3)]


def clicks_land_in_the_voxel_that_is_seen(browser):
    """Six clicks on each kind of affine: the grey seen under the mouse is that of the voxel which the program is told."""
    for affine in ("plain", "oblique", "sheared", "mirrored", "anisotropic"):
        with Server("--affine", affine, "--size", "48") as server:
            open_page(browser, server)
            if browser.js("document.getElementById('smooth').checked"):
                browser.press("#smooth")
            browser.key("x")  # without the crosshair's lines
            if browser.js("!document.getElementById('hint').hidden"):
                browser.press("#hint-close")
            if affine == "oblique":
                browser.key("r")  # neurological from here on
            browser.frame()
            state = server.get("api/state")
            low, high = state["volume"]["window"]
            for pane, across, down, modifiers in (("axial", .55, .45, 0), ("axial", .42, .61, SHIFT), ("coronal", .5, .37, 0),
                                                  ("coronal", .61, .58, SHIFT), ("sagittal", .44, .56, 0), ("sagittal", .63, .42, SHIFT)):
                x, y = place(browser, pane, across, down)
                # Outlines and marks of earlier clicks must not be what is seen.
                for o in server.get("api/state")["objects"]:
                    if o["id"] not in browser.js("studio.view.hidden"):
                        browser.key("h")
                browser.hover(x, y)
                browser.frame()
                time.sleep(0.1)
                seen = browser.pixel(x, y)
                count = len(server.received("click"))
                browser.click(x + 0.5, y + 0.5, modifiers)
                browser.until(f"studio.state.objects[0]?.clicks.length === {count + 1}")
                sent = server.received("click")[-1]
                index = voxel(state["volume"]["index_to_world"], sent["point"])
                nearest = [round(v) for v in index]
                value = server.get("mock/value?voxel=" + ",".join(map(str, nearest)))
                expected = 255 * (min(max(value, low), high) - low) / (high - low)
                check(seen[0] == seen[1] == seen[2], f"{affine} {pane}: something covers the slice: {seen}")
                check(abs(seen[0] - expected) <= 3, f"{affine} {pane}: {seen[0]} is seen, voxel {nearest} ({index}) has {expected:.0f}")
                check(sent["side"] == ("outside" if modifiers else "inside"), f"{affine} {pane}: side {sent['side']}")
                told = browser.js("document.getElementById('position').textContent")
                check(f"voxel{nearest[0]}, {nearest[1]}, {nearest[2]}" in told, f"{affine} {pane}: {nearest}, but the status line says {told}")


def clicking_dragging_deleting_and_undoing(browser):
    with Server() as server:
        open_page(browser, server)
        browser.press("#hint-close")
        x, y = place(browser, "axial")
        before = browser.js("studio.framesShown")
        started = time.time()
        browser.click(x, y)
        browser.until("studio.framesShown > %d" % before)
        first = time.time() - started
        done(browser)
        frames = browser.js("studio.framesShown") - before
        check(frames >= 5, f"{frames} frames in a second of evolution")
        print(f"    first outline after {first:.2f} s, {frames} frames")
        browser.picture("evolved")
        check(browser.js("studio.surfaces[0].arrays") == 2, "deviation and edge strength have come")

        browser.key("o")
        x2, y2 = place(browser, "axial", .75, .5)
        browser.click(x2, y2)
        browser.until("studio.state.objects[0].clicks.length === 2")
        check(server.received("click")[-1]["side"] == "outside", "the outside tool")
        browser.click(*place(browser, "axial", .5, .62), modifiers=SHIFT)
        browser.until("studio.state.objects[0].clicks.length === 3")
        check(server.received("click")[-1]["side"] == "inside", "Shift turns the outside tool round")
        done(browser)
        browser.key("c")
        browser.click(*place(browser, "axial", .5, .5))
        browser.frame()
        check(len(server.received("click")) == 3, "the crosshair's tool only looks")
        browser.key("i")

        point = browser.js("studio.state.objects[0].clicks[1].point")
        start = browser.js(f"studio.position('axial', {json.dumps(point)})")
        check(abs(start[0] - x2) < 1.5 and abs(start[1] - y2) < 1.5, f"the click is drawn where it was made: {start}")
        end = (start[0] + 25, start[1] - 30)
        expected = browser.js(f"studio.world('axial', {end[0]}, {end[1]})")
        browser.drag(start, end, steps=5, release=False)
        browser.frame()
        browser.picture("drag")
        browser.mouse("mouseReleased", *end, "left", buttons=0, clickCount=1)
        browser.until("studio.state.objects[0].clicks[1].point[0] !== %r" % point[0])
        moved = server.received("move_click")[-1]
        check(moved["index"] == 1, "the click that was dragged")
        check(max(abs(a - b) for a, b in zip(moved["point"], expected)) < 1.5, f"{moved['point']} for {expected}")
        check(len(server.received("click")) == 3, "a drag is no click")
        browser.until("studio.view.click?.index === 2")  # where it stands now: still the selected one
        done(browser)

        browser.drag((start[0], start[1] + 60), (start[0] - 40, start[1] + 90))
        browser.drag(end, (end[0] + 9, end[1]), release=False)
        browser.key("Escape")
        browser.mouse("mouseReleased", end[0] + 9, end[1], "left", buttons=0, clickCount=1)
        check(len(server.received("move_click")) == 1, "Esc gives a drag up")

        browser.click(*end)
        browser.frame()
        check(browser.js("studio.view.click?.index") == 2, "a click on a click selects it")
        browser.picture("selected")
        browser.key("Delete")
        browser.until("studio.state.objects[0].clicks.length === 2")
        check(server.received("delete_click")[-1]["index"] == 2, "Delete takes the selected click")
        browser.key("z", CTRL)
        browser.until("studio.state.objects[0].clicks.length === 3")
        browser.key("Z", CTRL | SHIFT)
        browser.until("studio.state.objects[0].clicks.length === 2")
        browser.press("#undo")
        browser.until("studio.state.objects[0].clicks.length === 3")
        browser.press(".click:first-child .icon-button")
        browser.until("studio.state.objects[0].clicks.length === 2")
        check(server.received("delete_click")[-1]["index"] == 2, "the newest click stands first")
        done(browser)

        browser.press("#undo")
        browser.until("studio.state.job !== null")
        browser.key("Escape")
        browser.until("studio.state.job === null")
        check(server.received("stop"), "Esc stops")
        browser.until("studio.state.objects[0].outcome === 'stopped'")
        browser.key("g")
        browser.until("studio.state.objects[0].outcome === 'converged'")


def of_many_clicks_the_newest_are_listed(browser):
    with Server() as server:
        segment_something(browser, server)
        listed = lambda: browser.js("[...document.querySelectorAll('.click')].map((row) => row.value)")
        browser.js("""(async () => {
            for (let k = 1; k < 25; ++k)
              await fetch('/api/do', { method: 'POST', headers: { 'Content-Type': 'application/json' },
                body: JSON.stringify({ action: 'click', object: 1, point: [k, 0, 0], side: 'inside' }) });
          })()""")
        browser.until("studio.state.objects[0].clicks.length === 25")
        done(browser)
        check(listed() == list(range(25, 5, -1)), f"listed: {listed()}")
        browser.press("[data-key=all-clicks]")
        check(listed() == list(range(25, 0, -1)), f"listed, all: {listed()}")
        check(browser.js("!document.querySelector('[data-key=all-clicks]')"), "nothing is left to be shown")
        browser.picture("many-clicks")


def the_view_moves_by_mouse_and_keyboard(browser):
    with Server("--ct") as server:
        open_page(browser, server)
        x, y = place(browser, "axial", .5, .4)
        z = browser.js("studio.crosshair[2]")
        browser.wheel(x, y, -100)
        browser.until("studio.crosshair[2] > %r" % (z + 1))
        check(abs(browser.js("studio.crosshair[2]") - z - 1.5) < 1e-3, "a notch of the wheel is one slice")
        browser.wheel(x, y, 100)
        browser.until("Math.abs(studio.crosshair[2] - %r) < 1e-3" % z)
        under = browser.js(f"studio.world('axial', {x}, {y})")
        browser.wheel(x, y, -300, CTRL)
        browser.frame()
        after = browser.js(f"studio.world('axial', {x}, {y})")
        check(max(abs(a - b) for a, b in zip(under, after)) < 1e-6, "zooming keeps the point under the mouse")
        check(browser.js(f"studio.world('axial', {x + 50}, {y})[0]") != under[0] - 50, "and zooms")
        browser.drag((x, y), (x + 40, y + 30), button="middle")
        browser.frame()
        moved = browser.js(f"studio.world('axial', {x + 40}, {y + 30})")
        check(max(abs(a - b) for a, b in zip(under, moved)) < 1e-6, "the picture follows the middle drag")
        browser.key("0")
        width = float(browser.js("document.getElementById('window-width').value"))
        browser.drag((x, y), (x + 100, y), button="right")
        check(float(browser.js("document.getElementById('window-width').value")) > 1.3 * width, "a right drag widens the window")
        check(browser.js("document.getElementById('window-preset').value") == "own", "by hand")
        browser.picture("window")
        browser.key("w")
        for name, level, wide in (("soft", 40, 400), ("bone", 500, 2000), ("lung", -600, 1500), ("brain", 40, 80)):
            browser.js(f"(() => {{ const s = document.getElementById('window-preset'); s.value = '{name}'; s.dispatchEvent(new Event('change')); }})()")
            got = [float(browser.js(f"document.getElementById('window-{k}').value")) for k in ("level", "width")]
            check(got == [level, wide], f"{name}: {got}")
        check(not server.received("click"), "none of this was a click")

        browser.key("r")
        check(browser.js("studio.view.radiological") is False, "neurological")
        left, right = (browser.js(f"studio.world('axial', {x + d}, {y})[0]") for d in (-50, 50))
        check(left < right, "the patient's left is on the left")
        browser.key("r")
        left, right = (browser.js(f"studio.world('axial', {x + d}, {y})[0]") for d in (-50, 50))
        check(left > right, "the patient's right is on the left")

        browser.click(*place(browser, "coronal"), modifiers=CTRL)
        here = browser.js("studio.crosshair")
        browser.key("ArrowUp")
        check(browser.js("studio.crosshair[2]") > here[2], "up in the coronal slice is superior")
        browser.key("PageUp")
        check(browser.js("studio.crosshair[1]") != here[1], "Page Up goes through the slices")
        browser.key("2")
        check(browser.js("studio.view.maximised") == "coronal", "enlarged")
        browser.frame()
        check(browser.js("studio.pane('coronal').width") > 900, "the pane has the whole stage")
        browser.picture("enlarged")
        browser.key("2")
        browser.key("Enter")
        browser.until("studio.state.objects[0]?.clicks.length === 1")
        here = browser.js("studio.crosshair")
        sent = server.received("click")[-1]["point"]
        check(max(abs(a - b) for a, b in zip(here, sent)) < 1e-6, "Enter clicks at the crosshair")
        done(browser)


def the_3d_view_turns_while_the_surface_evolves(browser):
    with Server() as server:
        open_page(browser, server)
        box = browser.js("(() => { const r = document.getElementById('pane-solid').getBoundingClientRect(); return [r.left, r.top, r.width, r.height]; })()")
        middle = round(box[0] + box[2] / 2), round(box[1] + box[3] / 2)
        browser.press("#hint-close")
        browser.click(*place(browser, "axial"))
        browser.until("studio.framesShown > 1")
        front = browser.js("studio.rotation")
        browser.drag(middle, (middle[0] + 60, middle[1] + 20))
        browser.frame()
        turned = browser.js("studio.rotation")
        check(max(abs(a - b) for a, b in zip(front, turned)) > 0.3, "it turns by hand")
        done(browser)
        check(browser.js("studio.rotation") == turned, "and stays so when newer surfaces come")
        det = (turned[0] * (turned[4] * turned[8] - turned[5] * turned[7]) - turned[3] * (turned[1] * turned[8] - turned[2] * turned[7])
               + turned[6] * (turned[1] * turned[5] - turned[2] * turned[4]))
        check(abs(det - 1) < 1e-9, f"neither mirrored nor scaled: {det}")
        # Where the surface is seen, a click brings the crosshair there.
        before = browser.js("studio.crosshair")
        browser.click(*middle)
        browser.frame()
        check(browser.js("studio.crosshair") != before, "the crosshair comes to the surface")
        check(len(server.received("click")) == 1, "which is no click of the object")
        browser.js("document.getElementById('pane-solid').focus()")
        browser.key("ArrowRight")
        check(browser.js("studio.rotation") != turned, "arrows turn it")
        browser.press("#pane-solid .tiny")
        check(browser.js("studio.rotation") == front, "and back to the front")


def a_click_is_moved_by_the_keyboard(browser):
    with Server() as server:
        open_page(browser, server)
        browser.press("#hint-close")
        browser.js("document.getElementById('pane-axial').focus()")
        browser.key("Enter")
        browser.until("studio.state.objects[0]?.clicks.length === 1")
        done(browser)
        browser.key("]")
        for _ in range(3):
            browser.key("ArrowRight")
        here = browser.js("studio.crosshair")
        browser.key("m")
        browser.until(f"studio.state.objects[0].clicks[0].point[0] === {here[0]!r}")
        check(server.received("move_click")[-1]["index"] == 0, "the selected one")
        done(browser)


def a_click_stays_selected_where_it_goes(browser):
    with Server() as server:
        segment_something(browser, server)
        for down in (.4, .6):
            browser.click(*place(browser, "axial", .5, down))
            done(browser)
        points = browser.js("studio.state.objects[0].clicks.map((c) => c.point)")
        browser.js("document.getElementById('pane-axial').focus()")
        browser.key("]")
        check(browser.js("studio.view.click.index") == 0, "the first of three")
        for n in (1, 2):
            browser.key("ArrowRight")
            browser.key("m")
            browser.until(f"studio.state.objects[0].clicks.length === 3 && studio.view.click?.index === 2")
            done(browser)
            check([r["index"] for r in server.received("move_click")] == [0, 2][:n], f"{server.received('move_click')}")
        browser.key("z", CTRL)
        browser.key("z", CTRL)
        browser.until(f"JSON.stringify(studio.state.objects[0].clicks.map((c) => c.point)) === JSON.stringify({json.dumps(points)})")
        check(browser.js("studio.view.click") is None, "where it was moved to is no click any more")
        done(browser)  # the list is made anew meanwhile
        browser.press("[data-key=click1]")
        check(browser.js("studio.view.click.index") == 1, "the second")
        browser.press("[data-key=delete0]")
        browser.until("studio.state.objects[0].clicks.length === 2")
        check(browser.js("studio.view.click") is None, "a click that was deleted by its cross leaves none selected")
        done(browser)  # the list is made anew meanwhile
        browser.press("[data-key=click1]")
        check(browser.js("studio.view.click.index") == 1, "the second of two")
        browser.js("""fetch('/api/do', { method: 'POST', headers: { 'Content-Type': 'application/json' },
            body: JSON.stringify({ action: 'delete_click', object: 1, index: 0 }) })""")  # by another page
        browser.until("studio.view.click?.index === 0")
        browser.key("Delete")
        browser.until("studio.state.objects[0].clicks.length === 0")


def a_click_that_is_another_one_by_now_is_left_alone(browser):
    with Server() as server:
        segment_something(browser, server)
        for down in (.4, .6):
            browser.click(*place(browser, "axial", .5, down))
            done(browser)
        points = browser.js("studio.state.objects[0].clicks.map((c) => c.point)")
        browser.js("document.getElementById('pane-axial').focus()")
        browser.key("]")
        browser.key("ArrowRight")
        # Twice before the first of them has come back as a state.
        browser.js("for (let k = 0; k < 2; k++) document.activeElement.dispatchEvent(new KeyboardEvent('keydown', { key: 'm', bubbles: true }))")
        browser.until("document.querySelector('.alert')")
        check("not where it was" in browser.js("document.querySelector('.alert').textContent"), "told")
        check([r["was"] for r in server.received("move_click")] == [points[0]] * 2, f"{server.received('move_click')}")
        done(browser)
        after = browser.js("studio.state.objects[0].clicks.map((c) => c.point)")
        check(after[:2] == points[1:], f"the others stay: {after}, before {points}")
        browser.key("Delete")
        browser.until("studio.state.objects[0].clicks.length === 2")
        check(server.received("delete_click")[-1]["was"] == after[2], "it was still selected")


def what_another_page_adds_leaves_the_active_object(browser):
    with Server() as server:
        segment_something(browser, server)
        browser.js("""fetch('/api/do', { method: 'POST', headers: { 'Content-Type': 'application/json' },
            body: JSON.stringify({ action: 'add_object' }) })""")
        browser.until("studio.state.objects.length === 2")
        browser.frame()
        check(browser.js("studio.view.active") == 1, "where the next click goes")


def a_page_that_is_not_seen_does_not_listen(browser):
    """A browser has six connections to a program, however many pages are open."""
    with Server() as server:
        segment_something(browser, server)

        def see(hidden):
            browser.js(f"Object.defineProperty(document, 'hidden', {{ value: {hidden}, configurable: true }});"
                       "document.dispatchEvent(new Event('visibilitychange'))")

        check(server.get("mock/streams") == 1, "it listens")
        see("true")
        end = time.time() + 10
        while server.get("mock/streams") and time.time() < end:
            time.sleep(0.05)
        check(server.get("mock/streams") == 0, "not any more")
        browser.js("""fetch('/api/do', { method: 'POST', headers: { 'Content-Type': 'application/json' },
            body: JSON.stringify({ action: 'rename', object: 1, name: 'left' }) })""")
        see("false")
        browser.until("studio.state.objects[0].name === 'left' && studio.connected")
        see("false")
        check(server.get("mock/streams") == 1, "it listens again, once")
        browser.click(*place(browser, "axial", .5, .4))
        browser.until("studio.state.objects[0].clicks.length === 2")
        done(browser)


def clicks_wait_where_the_graphics_are_lost(browser):
    with Server() as server:
        segment_something(browser, server)
        for canvas in ("slices", "solid"):
            browser.js(f"document.getElementById('{canvas}').getContext('webgl2').getExtension('WEBGL_lose_context').loseContext()")
            browser.until("document.querySelector('.alert')")
            check("reload the page" in browser.js("document.querySelector('.alert').textContent"), canvas)
            browser.press(".alert button")
        crosshair = browser.js("studio.crosshair")
        for pane in ("axial", "coronal"):
            browser.click(*place(browser, pane, .4, .4))
        browser.key("Enter")
        browser.press("#pane-solid")
        browser.frame()
        check(len(server.received("click")) == 1, "nobody sees what is clicked")
        check(browser.js("studio.crosshair") == crosshair, "nor looked at")


def objects_and_proposals(browser):
    with Server() as server:
        segment_something(browser, server)
        browser.until("document.querySelectorAll('.candidate').length === 3")
        browser.press(".candidate:nth-child(2)")
        browser.until("studio.state.objects[0].candidates[1]?.chosen")
        check(server.received("choose")[-1]["number"] == 2, "a proposal is taken")
        browser.press("#add-object")
        browser.until("studio.state.objects.length === 2")
        check(browser.js("studio.view.active") == 2, "a new object is the active one")
        browser.click(*place(browser, "coronal", .33, .4))
        browser.until("studio.state.objects[1].clicks.length === 1")
        check(len(browser.js("studio.state.objects[0].clicks")) == 1, "clicks belong to the active object")
        done(browser, 1)
        browser.press(".object:nth-child(2) .name")
        browser.js("document.activeElement.select()")
        browser.type("left kidney")
        browser.key("Enter")
        browser.until("studio.state.objects[1].name === 'left kidney'")
        browser.js("(() => { const c = document.querySelector('.object:nth-child(2) input[type=color]'); c.value = '#00ccaa';"
                   " c.dispatchEvent(new Event('change')); })()")
        browser.until("studio.state.objects[1].colour === '#00ccaa'")
        browser.js("(() => { const s = document.querySelector('.mesh-colour select'); s.value = 'deviation'; s.dispatchEvent(new Event('change')); })()")
        browser.until("document.querySelector('.legend')")
        browser.js("new Promise(r => setTimeout(r, 900))")
        browser.picture("objects")
        place_of = browser.js("studio.state.objects[1].verdict.place")
        browser.press("[data-key=place]")
        browser.frame()
        here = browser.js("studio.crosshair")
        check(max(abs(a - b) for a, b in zip(here, place_of)) <= 0.751, f"looks at {here} for {place_of}")
        browser.press(".object:nth-child(1) .icon-button")
        check(browser.js("studio.view.hidden") == [1], "hidden")
        browser.press("[data-key=copy]")
        browser.until("document.getElementById('notice').textContent.startsWith('Copied: surfseg replay')")
        browser.press(".object:nth-child(2) .icon-button:last-child")
        browser.until("studio.state.objects.length === 1")
        browser.until("document.getElementById('notice').textContent === 'left kidney was removed; undo brings it back'")
        check(browser.js("document.getElementById('undo').title") == "Undo removal of left kidney (Ctrl+Z)", "what undo does")
        browser.press("#undo")
        browser.until("studio.state.objects.length === 2")
        check(browser.js("studio.view.active") == 2, "what came back is the active one")
        check(browser.js("studio.state.objects[1].clicks.length === 1 && studio.state.objects[1].has_surface"), "as it was")
        for left in (1, 0):
            browser.press(".object:nth-child(1) .icon-button:last-child")
            browser.until(f"studio.state.objects.length === {left}")
        browser.key("z", CTRL)
        browser.until("studio.state.objects[0]?.name === 'left kidney'")
        check(server.received("undo")[-1]["object"] == 0, "where no object is left, the last removal is undone")
        browser.js("(() => { const s = document.querySelector('.mesh-colour select'); s.value = 'object'; s.dispatchEvent(new Event('change')); })()")


def proposals_are_drawn_although_they_come_before_the_volume(browser):
    with Server("--slow") as server:
        segment_something(browser, server)
        painted = """[...document.querySelectorAll('.candidate canvas')].filter((canvas) =>
            canvas.getContext('2d').getImageData(canvas.width / 2, canvas.height / 2, 1, 1).data[3] === 255).length"""
        browser.until(f"{painted} === 3")
        open_page(browser, server, "window.studio && studio.state?.objects.length === 1")
        browser.until("document.querySelectorAll('.candidate').length === 3")
        check(browser.js("!studio.ready"), "the volume is on its way")
        browser.until("studio.ready")
        browser.until(f"{painted} === 3", 10)


def what_was_hidden_in_one_scan_is_seen_in_the_next(browser):
    with Server() as server:
        segment_something(browser, server)
        browser.key("h")
        check(browser.js("studio.view.hidden") == [1], "hidden")
        server.get("mock/cut")
        browser.until("!studio.connected")
        browser.until("studio.connected", 10)
        browser.frame()
        check(browser.js("studio.view.hidden") == [1], "still, after the connection was lost")
        first = browser.js("studio.state.volume.revision")
        browser.press("#open-files")
        browser.press("#files-list button.file")
        browser.until(f"studio.state.volume.revision > {first} && studio.ready", 20)
        browser.press("#add-object")
        browser.until("studio.state.objects[0]?.id === 1")
        check(browser.js("studio.view.hidden") == [], "the first object of the next scan is seen")


def options_are_applied_together(browser):
    with Server() as server:
        segment_something(browser, server)
        browser.press("#tab-options")
        check(browser.js("document.getElementById('apply-options').disabled"), "nothing to apply yet")
        browser.press("#option-edge_length_mm")
        browser.type("1.5")
        browser.js("(() => { const s = document.getElementById('option-topology'); s.value = 'fixed'; s.dispatchEvent(new Event('change')); })()")
        browser.press("[data-key=add-energy]")
        browser.press("[data-key=energy0-lambda]")
        browser.type("2")
        browser.picture("options")
        check(not server.received("set_options"), "edits are a draft")
        browser.press("#apply-options")
        browser.until("studio.state.objects[0].options.edge_length_mm === 1.5")
        check(server.received("set_options")[-1]["options"] == {"edge_length_mm": 1.5, "topology": "fixed", "energies": ["minimal-surface:lambda=2"]},
              f"{server.received('set_options')[-1]}")
        done(browser)
        browser.js("(() => { const i = document.getElementById('option-edge_length_mm'); i.value = '-1'; i.dispatchEvent(new Event('input')); })()")
        browser.press("#apply-options")
        browser.until("document.querySelector('.alert')")
        check("expected more than 0 mm" in browser.js("document.querySelector('.alert').textContent"), "the program's own line")
        browser.picture("error")
        browser.press(".alert button")
        check(browser.js("document.querySelectorAll('.alert').length") == 0, "dismissed")


def options_that_are_typed_meanwhile_are_kept(browser):
    with Server() as server:
        segment_something(browser, server)
        browser.press("#tab-options")
        browser.press("#option-edge_length_mm")
        browser.type("1.5")
        # Until answered() is called no answer comes.
        browser.js("""(() => { const asked = window.fetch, waits = new Promise((go) => { window.answered = go; });
            window.fetch = async (...words) => { const answer = await asked(...words); await waits; return answer; }; })()""")
        browser.press("#apply-options")
        browser.until("studio.state.objects[0].options.edge_length_mm === 1.5")
        browser.press("#option-smoothing")
        browser.type("3")
        browser.js("answered()")
        done(browser)
        check(browser.js("document.getElementById('option-smoothing').value") == "3", "still there")
        browser.press("#apply-options")
        browser.until("studio.state.objects[0].options.smoothing === 3")
        check(server.received("set_options")[-1]["options"] == {"smoothing": 3}, "and applied")


def options_that_another_page_sets_stay(browser):
    with Server() as server:
        segment_something(browser, server)
        other = lambda options: browser.js(  # noqa: E731
            "fetch('/api/do', { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify("
            f"{{ action: 'set_options', object: 1, options: {json.dumps(options)} }}) }})")
        other({"fill_cavities": True})
        browser.until("studio.state.objects[0].options.fill_cavities")
        browser.press("#tab-options")
        browser.press("#option-edge_length_mm")
        browser.type("1.5")
        other({"smoothing": 3, "fill_cavities": None})
        browser.until("studio.state.objects[0].options.smoothing === 3")
        browser.until("document.getElementById('option-smoothing').value === '3'")
        check(browser.js("document.getElementById('option-edge_length_mm').value") == "1.5", "the draft")
        browser.press("#apply-options")
        browser.until("studio.state.objects[0].options.edge_length_mm === 1.5")
        check(server.received("set_options")[-1]["options"] == {"edge_length_mm": 1.5}, f"{server.received('set_options')[-1]}")
        check(browser.js("studio.state.objects[0].options") == {"smoothing": 3, "edge_length_mm": 1.5}, "both")
        done(browser)


def an_option_that_was_set_is_reset(browser):
    with Server() as server:
        segment_something(browser, server)
        browser.press("#tab-options")
        every = {"edge_length_mm": 1.5, "topology": "fixed", "fill_cavities": True, "energies": ["minimal-surface:lambda=2"]}

        def choose(field, value, event="change"):
            browser.js(f"(() => {{ const f = document.getElementById('{field}'); f.value = '{value}'; f.dispatchEvent(new Event('{event}')); }})()")

        def apply(expected, sent):
            browser.press("#apply-options")
            browser.until(f"JSON.stringify(studio.state.objects[0].options) === JSON.stringify({json.dumps(expected)})", 10)
            check(server.received("set_options")[-1]["options"] == sent, f"{server.received('set_options')[-1]}")
            done(browser)

        choose("option-edge_length_mm", "1.5", "input")
        choose("option-topology", "fixed")
        choose("option-fill_cavities", "true")
        browser.press("[data-key=add-energy]")
        browser.press("[data-key=energy0-lambda]")
        browser.type("2")
        apply(every, every)
        choose("option-edge_length_mm", "", "input")
        choose("option-topology", "")
        browser.press("[data-key=energy-remove0]")
        apply({"fill_cavities": True}, {"edge_length_mm": None, "topology": None, "energies": None})
        browser.press("[data-key=standard]")
        apply({}, {"fill_cavities": None})


def files_are_exported_and_overwritten_after_a_question(browser):
    with Server() as server:
        segment_something(browser, server)
        browser.key("e")
        browser.until("document.getElementById('export').open")
        browser.picture("export")
        check(browser.js("document.getElementById('export-name').value") == "phantom-object-1.stl", "a name is proposed")
        browser.press("#export-go")
        browser.until("document.querySelector('.result.good')")
        check(server.received("export")[-1]["export"] == dict(what="surface", object=1, format="stl", space="lps", name="phantom-object-1.stl", overwrite=False),
              "the request")
        browser.press("#export-go")
        browser.until("document.querySelector('.result.bad')")
        check(browser.js("document.getElementById('export-go').textContent") == "Overwrite", "asks first")
        browser.picture("overwrite")
        browser.press("#export-go")
        browser.until("document.querySelector('.result.good')")
        check(server.received("export")[-1]["export"]["overwrite"] is True, "overwritten after the question")
        for kind, name in (("report", "phantom-object-1-report.html"), ("measures", "phantom-object-1-measures.csv"), ("labels", "phantom-object-1-labels.nii.gz")):
            browser.press(f"[data-key=kind-{kind}]")
            check(browser.js("document.getElementById('export-name').value") == name, f"the name of {kind}")
        browser.press("[data-key=kind-recipe]")
        check(browser.js("document.getElementById('export-name').value") == "phantom-recipe.json", "a recipe is of all objects")
        check(browser.js("document.getElementById('export-object') === null"), "and has no choice of one")
        browser.press("#export-go")
        browser.until("document.querySelector('.result.good')")
        check(server.received("export")[-1]["export"]["object"] == 0, "all")
        browser.press("[data-key=kind-labels]")
        browser.js("document.getElementById('export-name').value = '../a.nii.gz'; document.getElementById('export-name').dispatchEvent(new Event('input'))")
        browser.press("#export-go")
        browser.until("document.querySelector('.result.bad')")
        check("without a folder" in browser.js("document.querySelector('.result').textContent"), "the program's own line")
        browser.key("Escape")
        browser.until("!document.getElementById('export').open")
        check(not server.received("stop"), "Esc closed the dialog only")


def files_are_listed_where_no_volume_is_open(browser):
    with Server("--closed") as server:
        open_page(browser, server, "window.studio && studio.state")
        browser.until("!document.getElementById('files').hidden")
        browser.picture("files")
        browser.press("#files-filter")
        browser.type("07")
        browser.until("document.querySelectorAll('#files-list .path').length === 3")
        browser.press("#files-list ul button")
        browser.until("studio.ready")
        check(server.received("open")[-1] == {"action": "open", "path": "dicom/patient-07", "series": "3"}, "a series is opened")
        browser.press("#open-files")
        browser.until("!document.getElementById('files').hidden")
        browser.key("Escape")
        browser.until("document.getElementById('files').hidden")


def errors_and_a_lost_connection_are_told(browser):
    server = Server()
    try:
        open_page(browser, server)
        server.get("mock/error")
        browser.until("document.querySelector('.alert')")
        check(browser.js("document.querySelector('.alert').getAttribute('role')") == "alert", "told to screen readers")
        check("no space left on device" in browser.js("document.querySelector('.alert').textContent"), "the line")
        browser.press(".alert button")
        server.get("mock/cut")
        browser.until("!studio.connected")
        browser.until("studio.connected", 10)
        port = server.address.split(":")[2].strip("/")
        server.__exit__()
        browser.until("!document.getElementById('lost').hidden")
        browser.picture("lost")
        server = Server("--port", port)
        browser.until("studio.connected && studio.ready", 20)
        browser.until("!document.querySelector('.alert')")
        server.get("mock/error")
        browser.until("document.querySelector('.alert')", 10)  # the first one of the new program
    finally:
        server.__exit__()


def the_volume_of_a_program_that_was_started_anew_is_shown(browser):
    first = Server("--size", "48")
    try:
        segment_something(browser, first)
        seen = browser.js("studio.state.volume.revision")
    finally:
        first.__exit__()
    browser.until("!studio.connected")
    with Server("--affine", "mirrored", "--size", "40", "--port", first.address.split(":")[2].strip("/")) as server:
        browser.until(f"studio.state?.volume?.revision > {seen} && studio.ready", 20)
        check(browser.js("studio.surfaces.length") == 0, "no surface of the other one")
        affine = server.get("api/state")["volume"]["index_to_world"]
        for index in ((20, 18, 16), (3, 5, 7), (30, 20, 9)):
            point = [sum(a * b for a, b in zip(row, (*index, 1))) for row in affine[:3]]
            seen, value = browser.js(f"studio.valueAt({point})"), server.get("mock/value?voxel=" + ",".join(map(str, index)))
            check(seen == value, f"{seen} at {index}, where the volume has {value}")


def a_volume_that_does_not_come_is_asked_for_again_after_a_lost_connection_alone(browser):
    with Server("--broken") as server:
        open_page(browser, server, "document.querySelector('.alert')")
        check("no memory is left" in browser.js("document.querySelector('.alert').textContent"), "the reason")
        time.sleep(1)
        check(server.get("mock/asked") == 1, f"asked {server.get('mock/asked')} times")
        server.get("mock/mend")
        server.get("mock/cut")
        browser.until("studio.ready", 20)
        check(server.get("mock/asked") == 2, "once more")


def dark_light_help_and_no_foreign_requests(browser):
    with Server() as server:
        browser.colour_scheme("dark")
        open_page(browser, server)
        check(browser.js("document.documentElement.dataset.theme") == "dark", "as the system has it")
        check(not browser.js("document.getElementById('hint').hidden"), "the hint is shown once")
        browser.picture("dark")
        browser.press("#hint-close")
        browser.colour_scheme("light")
        browser.until("document.documentElement.dataset.theme === 'light'")
        browser.key("t")
        check(browser.js("document.documentElement.dataset.theme") == "dark", "chosen")
        browser.key("?")
        browser.until("document.getElementById('help').open")
        browser.picture("help")
        browser.key("Escape")
        open_page(browser, server)
        check(browser.js("document.documentElement.dataset.theme") == "dark", "the choice lasts")
        check(browser.js("document.getElementById('hint').hidden"), "the hint does not come again")
        nameless = browser.js("""[...document.querySelectorAll('button, input, select')].filter(e => !e.textContent.trim() && !e.getAttribute('aria-label')
            && !e.labels?.length).map(e => e.outerHTML)""")
        check(not nameless, f"controls without a name: {nameless}")
        foreign = [u for u in browser.requests() if not u.startswith(("http://127.0.0.1:", "data:", "blob:", "about:"))]
        check(not foreign, f"{foreign}")


TESTS = [clicks_land_in_the_voxel_that_is_seen, clicking_dragging_deleting_and_undoing,
         of_many_clicks_the_newest_are_listed, the_view_moves_by_mouse_and_keyboard,
         the_3d_view_turns_while_the_surface_evolves, a_click_is_moved_by_the_keyboard, a_click_stays_selected_where_it_goes,
         a_click_that_is_another_one_by_now_is_left_alone, what_another_page_adds_leaves_the_active_object,
         a_page_that_is_not_seen_does_not_listen, clicks_wait_where_the_graphics_are_lost, objects_and_proposals, proposals_are_drawn_although_they_come_before_the_volume,
         what_was_hidden_in_one_scan_is_seen_in_the_next, options_are_applied_together, options_that_are_typed_meanwhile_are_kept,
         options_that_another_page_sets_stay, an_option_that_was_set_is_reset,
         files_are_exported_and_overwritten_after_a_question,
         files_are_listed_where_no_volume_is_open, errors_and_a_lost_connection_are_told,
         the_volume_of_a_program_that_was_started_anew_is_shown,
         a_volume_that_does_not_come_is_asked_for_again_after_a_lost_connection_alone, dark_light_help_and_no_foreign_requests]


if __name__ == "__main__":
    sys.exit(run_tests(TESTS, needs=["node"]))
