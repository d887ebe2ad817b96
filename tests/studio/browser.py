"""Drives Debian's Chromium by the DevTools protocol over a pipe: real input events, evaluation, screenshots.

Needs nothing but Python and Chromium; no driver, no packages.
"""
import base64
import json
import os
import select
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import zlib

SHIFT, CTRL = 8, 2
BUTTONS = {"none": 0, "left": 1, "right": 2, "middle": 4}
KEY_CODES = {"Enter": 13, "Escape": 27, "Delete": 46, "PageUp": 33, "PageDown": 34, "ArrowLeft": 37, "ArrowUp": 38,
             "ArrowRight": 39, "ArrowDown": 40, "Tab": 9, "Backspace": 8, " ": 32}


class BrowserError(Exception):
    pass


def find_browser():
    """Chromium's path, or None where there is none."""
    return shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def first_pixel(png):
    """The first pixel of a PNG of 8 bits per channel: whatever its filter is, it has no neighbours before it."""
    depth, colour_type = png[24], png[25]
    data, at = b"", 8
    while at < len(png):
        length, kind = struct.unpack(">I4s", png[at:at + 8])
        if kind == b"IDAT":
            data += png[at + 8:at + 8 + length]
        at += 12 + length
    if depth != 8 or colour_type not in (2, 6):
        raise BrowserError(f"a picture of colour type {colour_type} with {depth} bits")
    return tuple(zlib.decompress(data)[1:4])


class Browser:
    def __init__(self, size=(1400, 860), executable=None):
        read_answers, write_answers = os.pipe()
        read_commands, write_commands = os.pipe()
        self.folder = tempfile.mkdtemp(prefix="surfseg-browser-")
        arguments = [executable or find_browser(), "--headless=new", "--remote-debugging-pipe",
                     f"--user-data-dir={self.folder}", f"--window-size={size[0]},{size[1]}", "--no-first-run",
                     "--disable-extensions", "--mute-audio", "--hide-scrollbars",
                     # WebGL by the processor, so that machines without graphics do the same.
                     "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "about:blank"]
        if os.geteuid() == 0:
            arguments.insert(2, "--no-sandbox")  # Chromium's sandbox refuses root

        def descriptors():  # Chromium reads 3 and writes 4
            commands, answers = os.dup(read_commands), os.dup(write_answers)
            os.dup2(commands, 3)
            os.dup2(answers, 4)
            os.set_inheritable(3, True)
            os.set_inheritable(4, True)

        self.process = subprocess.Popen(arguments, preexec_fn=descriptors, close_fds=False, stdout=subprocess.DEVNULL,
                                        stderr=open(self.folder + "/errors", "w"))
        os.close(read_commands)
        os.close(write_answers)
        self.write, self.read_end = write_commands, read_answers
        self.number, self.rest, self.events, self.session = 0, b"", [], None
        self.size, self.context = size, None
        page = [t for t in self("Target.getTargets")["targetInfos"] if t["type"] == "page"][0]
        self._attach(page["targetId"])

    def _attach(self, page):
        self.session = self("Target.attachToTarget", targetId=page, flatten=True)["sessionId"]
        for domain in ("Runtime", "Page", "Log", "Network"):
            self(domain + ".enable")
        self.resize(*self.size)

    def fresh(self):
        """An empty page in a profile of its own, which knows nothing of those before; they are closed."""
        self.session, before = None, self.context
        self.context = self("Target.createBrowserContext")["browserContextId"]
        page = self("Target.createTarget", url="about:blank", browserContextId=self.context)["targetId"]
        if before:
            self("Target.disposeBrowserContext", browserContextId=before)
        self.events = []
        self._attach(page)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def resize(self, width, height, ratio=1):
        self("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=ratio, mobile=False)

    def _message(self, limit=120):
        end = time.time() + limit
        while b"\0" not in self.rest:
            if not select.select([self.read_end], [], [], max(0, end - time.time()))[0]:
                raise BrowserError(f"no answer from the browser within {limit} s")
            data = os.read(self.read_end, 1 << 20)
            if not data:
                raise BrowserError("the browser ended: " + open(self.folder + "/errors").read()[-2000:])
            self.rest += data
        message, self.rest = self.rest.split(b"\0", 1)
        return json.loads(message)

    def __call__(self, method, **parameters):
        self.number += 1
        message = dict(id=self.number, method=method, params=parameters)
        if self.session:
            message["sessionId"] = self.session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self.write, data):]
        while True:
            answer = self._message()
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise BrowserError(f"{method}: {answer['error']}")
                return answer["result"]
            self.events.append(answer)

    def open(self, address):
        self("Page.navigate", url=address)

    def js(self, expression):
        """The value of an expression in the page; promises are waited for."""
        answer = self("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True, userGesture=True)
        if "exceptionDetails" in answer:
            raise BrowserError(f"{expression}: {json.dumps(answer['exceptionDetails'])[:800]}")
        return answer["result"].get("value")

    def until(self, expression, limit=60):
        """Waits until an expression is true; returns the seconds that took."""
        start = time.time()
        while time.time() - start < limit:
            if self.js(f"!!({expression})"):
                return time.time() - start
            time.sleep(0.03)
        raise BrowserError(f"not true after {limit} s: {expression}\n{self.log()}")

    def frame(self):
        """Waits until the page has drawn."""
        self.js("new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))")

    def log(self):
        """What the console said: errors, warnings, refusals by the content security policy."""
        lines = []
        for event in self.events:
            parameters = event.get("params", {})
            if event.get("method") == "Runtime.consoleAPICalled":
                lines.append(parameters["type"] + ": " + " ".join(str(a.get("value", a.get("description"))) for a in parameters["args"])[:300])
            elif event.get("method") == "Log.entryAdded":
                lines.append(f"{parameters['entry']['level']}: {parameters['entry']['text'][:300]} {parameters['entry'].get('url', '')}")
            elif event.get("method") == "Runtime.exceptionThrown":
                lines.append("exception: " + json.dumps(parameters["exceptionDetails"])[:500])
        return "\n".join(lines)

    def requests(self):
        """The addresses that the page asked for."""
        return [e["params"]["request"]["url"] for e in self.events if e.get("method") == "Network.requestWillBeSent"]

    # ---- input

    def mouse(self, kind, x, y, button="none", modifiers=0, buttons=None, **more):
        self("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, modifiers=modifiers,
             buttons=BUTTONS[button] if buttons is None else buttons, **more)

    def hover(self, x, y):
        self.mouse("mouseMoved", x, y)

    def click(self, x, y, modifiers=0, button="left"):
        self.mouse("mouseMoved", x, y, modifiers=modifiers)
        self.mouse("mousePressed", x, y, button, modifiers, clickCount=1)
        self.mouse("mouseReleased", x, y, button, modifiers, buttons=0, clickCount=1)

    def drag(self, start, end, button="left", modifiers=0, steps=6, release=True):
        self.mouse("mouseMoved", *start, modifiers=modifiers)
        self.mouse("mousePressed", *start, button, modifiers, clickCount=1)
        for k in range(1, steps + 1):
            x, y = (a + (b - a) * k / steps for a, b in zip(start, end))
            self.mouse("mouseMoved", x, y, button, modifiers)
        if release:
            self.mouse("mouseReleased", *end, button, modifiers, buttons=0, clickCount=1)

    def wheel(self, x, y, delta, modifiers=0):
        self.mouse("mouseWheel", x, y, modifiers=modifiers, deltaX=0, deltaY=delta)

    def key(self, key, modifiers=0):
        code = KEY_CODES.get(key, ord(key.upper()) if len(key) == 1 else 0)
        text = key if len(key) == 1 and not modifiers & CTRL else "\r" if key == "Enter" else ""
        more = dict(text=text) if text else {}
        self("Input.dispatchKeyEvent", type="keyDown", key=key, windowsVirtualKeyCode=code, modifiers=modifiers, **more)
        self("Input.dispatchKeyEvent", type="keyUp", key=key, windowsVirtualKeyCode=code, modifiers=modifiers)

    def type(self, text):
        self("Input.insertText", text=text)

    def press(self, selector):
        """A real click in the middle of an element."""
        self.js(f"document.querySelector({json.dumps(selector)}).scrollIntoView({{block: 'nearest'}})")
        box = self.js(f"(() => {{ const r = document.querySelector({json.dumps(selector)}).getBoundingClientRect();"
                      " return [r.left + r.width / 2, r.top + r.height / 2, r.width] })()")
        if not box[2]:
            raise BrowserError(f"{selector} is not to be seen")
        self.click(box[0], box[1])

    def colour_scheme(self, scheme):
        self("Emulation.setEmulatedMedia", features=[dict(name="prefers-color-scheme", value=scheme)])

    def screenshot(self, path):
        self.frame()
        with open(path, "wb") as file:
            file.write(base64.b64decode(self("Page.captureScreenshot", format="png")["data"]))

    def pixel(self, x, y):
        """The colour (r, g, b) that is seen at a position."""
        clip = dict(x=x, y=y, width=1, height=1, scale=1)
        return first_pixel(base64.b64decode(self("Page.captureScreenshot", format="png", clip=clip)["data"]))

    pictures = None  # a folder for picture()

    def picture(self, name):
        """A screenshot, where they are wanted."""
        if self.pictures:
            os.makedirs(self.pictures, exist_ok=True)
            self.screenshot(os.path.join(self.pictures, name + ".png"))

    def close(self):
        try:
            self("Browser.close")
        except (BrowserError, OSError):
            pass
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


def run_tests(tests, needs=()):
    """The program: [--screenshots FOLDER] [name ...]. Each test gets a fresh page, whose console must stay quiet; to start
    a browser for each takes as long as most tests. Returns 77 where Chromium or another program is missing."""
    arguments, pictures = sys.argv[1:], None
    if "--screenshots" in arguments:
        k = arguments.index("--screenshots")
        pictures = arguments[k + 1]
        del arguments[k:k + 2]
    missing = [program for program in needs if not shutil.which(program)] + ([] if find_browser() else ["Chromium"])
    if missing:
        print(f"skipped: {', '.join(missing)} missing")
        return 77
    failed, browser = 0, None
    try:
        for test in tests:
            if arguments and test.__name__ not in arguments:
                continue
            started, name = time.time(), test.__name__.replace("_", " ")
            browser = browser or Browser()
            browser.pictures = pictures
            try:
                browser.fresh()
                test(browser)
                log = [line for line in browser.log().splitlines() if "exception" in line or "Content Security Policy" in line]
                if log:
                    raise BrowserError("the console says: " + "; ".join(log))
                print(f"passed  {name} ({time.time() - started:.1f} s)", flush=True)
            except Exception as error:
                failed += 1
                print(f"FAILED  {name}: {error}\n{browser.log()}", flush=True)
                try:
                    browser.picture("failed-" + test.__name__)
                except (BrowserError, OSError):
                    pass
                browser.close()  # whatever it is in; the next test starts another
                browser = None
    finally:
        if browser:
            browser.close()
    return 1 if failed else 0
