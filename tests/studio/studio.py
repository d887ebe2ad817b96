"""A studio that runs in a folder of its own, and requests to it; Python alone."""
import array
import http.client
import json
import math
import os
import struct
import subprocess
import tempfile
import time

# A phantom, and a point in each of its balls.
BALLS = ("balls.nii.gz", "separate-balls", "--size", "40", "--noise", "0.05")
LEFT, RIGHT = (-0.5, 0, 0), (0.5, 0, 0)


def content(folder, name):
    with open(os.path.join(folder, name), "rb") as file:
        return file.read()


class Studio:
    def __init__(self, folder, *words, environment=None, before=(), opens_browser=False):
        """before: words before the program's name, such as those of mounted()."""
        self.folder = folder
        self.process = subprocess.Popen(
            [*before, os.environ["SURFSEG_PROGRAM"], "studio", *([] if opens_browser else ["--no-open"]), *words],
            cwd=folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            env={**os.environ, **(environment or {})})
        self.address = self.process.stdout.readline().strip()
        if not self.address:
            raise RuntimeError(self.process.communicate()[1])
        self.port = int(self.address.split(":")[2].split("/")[0])
        self.token = self.address.split("token=")[1]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.end()

    def end(self):
        """Returns what it said on the terminal."""
        self.process.terminate()
        self.process.wait(20)
        said = self.process.stderr.read()
        self.process.stdout.close()
        self.process.stderr.close()
        return said

    def listed(self):
        """Names in its folder as the program sees it."""
        return sorted(os.listdir(f"/proc/{self.process.pid}/cwd"))

    def memory_mb(self):
        """Of the program: what is resident."""
        with open(f"/proc/{self.process.pid}/status") as file:
            return next(int(line.split()[1]) / 1024 for line in file if line.startswith("VmRSS"))

    def request(self, method, path, body=None, headers=None, token=True):
        """(status, body, headers); headers of None are left out."""
        sent = {"Authorization": f"Bearer {self.token}"} if token else {}
        if isinstance(body, dict):
            body = json.dumps(body)
            sent["Content-Type"] = "application/json"
        sent.update(headers or {})
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        try:
            connection.request(method, path, body, {k: v for k, v in sent.items() if v is not None})
            answer = connection.getresponse()
            return answer.status, answer.read(), dict(answer.getheaders())
        finally:
            connection.close()

    def get(self, path):
        status, body, _ = self.request("GET", path)
        assert status == 200, (path, status, body)
        return body

    def do(self, action, expect=200, **what):
        status, body, _ = self.request("POST", "/api/do", {"action": action, **what})
        assert expect in (status, None), (action, what, status, body)  # None: it may be refused
        return json.loads(body)

    def export(self, expect=200, **what):
        status, body, _ = self.request("POST", "/api/export", what)
        assert status == expect, (what, status, body)
        return json.loads(body)

    def state(self):
        return json.loads(self.get("/api/state"))

    def click(self, point, side="inside", object=1, expect=200):
        return self.do("click", expect, object=object, point=list(point), side=side)

    def until(self, condition, limit=120):
        end = time.time() + limit
        while time.time() < end:
            state = self.state()
            if condition(state):
                return state
            time.sleep(0.02)
        raise AssertionError(f"not within {limit} s: {json.dumps(state)[:2000]}")

    def idle(self):
        """The state when nothing is computed any more."""
        return self.until(lambda s: s["job"] is None and s["volume"] is not None
                          and all(o["has_surface"] or not o["clicks"] for o in s["objects"]))


def can_mount():
    """Whether a user may have mounts of his own here."""
    try:
        return subprocess.run(["unshare", "--map-root-user", "--mount", "mount", "-t", "tmpfs", "none", "/mnt"],
                              capture_output=True).returncode == 0
    except FileNotFoundError:
        return False


def mounted(source, room=None):
    """Words before a program's name: its folder becomes a disk of its own that holds the files of `source`, with `room`
    bytes to spare, or, without them, read-only."""
    pages = sum(-(-os.path.getsize(os.path.join(source, name)) // 4096) for name in os.listdir(source)) + (room or 0) // 4096
    size = f"size={4 * pages}k" if room else "size=64m"
    then = "true" if room else 'mount -o remount,ro "$PWD"'
    return ["unshare", "--map-root-user", "--mount", "sh", "-c",
            f'mount -t tmpfs -o {size} none "$PWD" && cd "$PWD" && cp "$0"/* . && {then} && exec "$@"', source]


def phantom(folder, name, *words):
    subprocess.run([os.environ["SURFSEG_PROGRAM"], "phantom", *words, "-o", os.path.join(folder, name)],
                   check=True)


def folder_with(*phantoms):
    """A new folder with volumes: [(name, words...), ...]"""
    folder = tempfile.mkdtemp(prefix="surfseg-studio-")
    for name, *words in phantoms:
        phantom(folder, name, *words)
    return folder


def write_dicom(path, series, slice_number, n=32):
    """An MR slice of n x n pixels, explicit little endian: a bright disc on a dark ground."""
    def element(group, number, kind, value):
        value = value.encode() if isinstance(value, str) else value
        if len(value) % 2:
            value += b"\0" if kind == "UI" else b" "
        head = struct.pack("<HH2s", group, number, kind.encode())
        long = kind in ("OB", "OW")
        return head + (struct.pack("<HI", 0, len(value)) if long else struct.pack("<H", len(value))) + value

    short = lambda value: struct.pack("<H", value)  # noqa: E731
    middle = (n - 1) / 2
    radius = math.sqrt(max(0, 100 - (slice_number - 12) ** 2))
    pixels = array.array("H", (900 if math.hypot(x - middle, y - middle) < radius else 100
                               for y in range(n) for x in range(n)))
    instance = f"{series}.{slice_number + 1}"
    meta = b"".join([element(2, 2, "UI", "1.2.840.10008.5.1.4.1.1.4"), element(2, 3, "UI", instance),
                     element(2, 0x10, "UI", "1.2.840.10008.1.2.1")])
    data = b"".join([
        element(8, 0x16, "UI", "1.2.840.10008.5.1.4.1.1.4"), element(8, 0x18, "UI", instance),
        element(8, 0x60, "CS", "MR"), element(8, 0x103e, "LO", f"series {series[-1]}"),
        element(0x20, 0xd, "UI", "1.2.3"), element(0x20, 0xe, "UI", series),
        element(0x20, 0x32, "DS", f"0\\0\\{slice_number}"), element(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0"),
        element(0x28, 2, "US", short(1)), element(0x28, 4, "CS", "MONOCHROME2"),
        element(0x28, 0x10, "US", short(n)), element(0x28, 0x11, "US", short(n)),
        element(0x28, 0x30, "DS", "1\\1"), element(0x28, 0x100, "US", short(16)),
        element(0x28, 0x101, "US", short(16)), element(0x28, 0x102, "US", short(15)),
        element(0x28, 0x103, "US", short(0)), element(0x7fe0, 0x10, "OW", pixels.tobytes())])
    with open(path, "wb") as file:
        file.write(b"\0" * 128 + b"DICM" + element(2, 0, "UL", struct.pack("<I", len(meta))) + meta + data)
