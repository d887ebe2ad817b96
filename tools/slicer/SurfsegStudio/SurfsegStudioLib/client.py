"""A client of `surfseg studio` (docs/studio-protocol.md). Python's own library alone.

Points and surfaces are RAS mm, as Slicer's scene is: nothing is flipped on the way."""
import array
import http.client
import json
import os
import shutil
import struct
import subprocess
import sys
import threading
import time
import urllib.parse


class StudioError(Exception):
    """The studio refused, is not there, or is another program; one line for a person."""


class StudioRefused(StudioError):
    """It is there and does not do what was asked, such as a click outside the volume. With the
    status 409 a click is another one by now than the one of the state."""

    def __init__(self, reason, status=400):
        super().__init__(reason)
        self.status = status


class Surface:
    """Triangles as the studio sends them."""

    def __init__(self, points, triangles, arrays=(), frame=0):
        self.points = points        # array of float, x y z after each other, RAS mm
        self.triangles = triangles  # array of unsigned int, three indices after each other
        self.arrays = list(arrays)  # none, or deviation in mm and edge strength of each point
        self.frame = frame          # > 0 while it evolves

    @property
    def n_points(self):
        return len(self.points) // 3

    @property
    def n_triangles(self):
        return len(self.triangles) // 3


def _array(kind, data):
    out = array.array(kind)
    assert out.itemsize == 4
    out.frombytes(data)
    if sys.byteorder == "big":
        out.byteswap()
    return out


def parse_surface(data):
    """A Surface from the bytes of /api/surface."""
    if len(data) < 16:
        raise StudioError("the studio sent a surface without a head")
    n_points, n_triangles, n_arrays, frame = struct.unpack_from("<4I", data)
    sizes = [("f", 12 * n_points), ("I", 12 * n_triangles)] + [("f", 4 * n_points)] * n_arrays
    if len(data) != 16 + sum(size for _, size in sizes):
        raise StudioError(f"the studio sent {len(data)} bytes for a surface of {n_points} points and "
                          f"{n_triangles} triangles")
    parts, at = [], 16
    for kind, size in sizes:
        parts.append(_array(kind, data[at:at + size]))
        at += size
    points, triangles, *arrays = parts
    if n_triangles and max(triangles) >= n_points:
        raise StudioError("the studio sent a triangle of a point that there is not")
    return Surface(points, triangles, arrays, frame)


def parse_address(address):
    """(host, port, token) of the address that the studio prints."""
    parts = urllib.parse.urlsplit(address.strip())
    token = urllib.parse.parse_qs(parts.query).get("token", [""])[0]
    try:
        port = parts.port
    except ValueError:
        port = None
    if parts.scheme != "http" or not port or not token:
        raise StudioError("expected the address that surfseg studio prints, such as "
                          "http://127.0.0.1:8911/?token=...")
    if parts.hostname not in ("127.0.0.1", "localhost"):
        raise StudioError("a studio listens on 127.0.0.1 alone; for another machine see docs/studio.md")
    return parts.hostname, port, token


def _is_same(a, b, tolerance_mm=1e-4):
    return a[0] == b[0] and all(abs(p - q) <= tolerance_mm for p, q in zip(a[1], b[1]))


def lacking(clicks, side, points):
    """Where a state's clicks of a side are that none of the points is."""
    return [c["point"] for c in clicks if c["side"] == side
            and not any(_is_same((side, c["point"]), (side, p)) for p in points)]


def changes(clicks, wanted):
    """The actions that make the object's clicks those that are wanted: points that moved and went,
    then those that came. Both are lists of (side, (x, y, z)); the order of the clicks may be
    another one afterwards."""
    new = list(wanted)
    old = []  # (index, click) of those that are not wanted where they are
    for index, click in enumerate(clicks):
        match = next((w for w in new if _is_same(click, w)), None)
        if match is None:
            old.append((index, click))
        else:
            new.remove(match)
    actions = []
    # The studio takes a click that moves out, too, and puts it at the end: each of these stands
    # where it was but for those before it. So clicks that move together keep their order. By "was"
    # it refuses where the page has done something meanwhile.
    for n_before, (index, (side, point)) in enumerate(old):
        moved = next((w for w in new if w[0] == side), None)
        where = {"index": index - n_before, "was": list(point)}
        if moved is None:
            actions.append({"action": "delete_click", **where})
        else:
            actions.append({"action": "move_click", **where, "point": list(moved[1])})
            new.remove(moved)
    # An object has to have something inside before anything is outside of it.
    new.sort(key=lambda click: click[0] != "inside")
    return actions + [{"action": "click", "side": side, "point": list(point)} for side, point in new]


class Studio:
    """A running studio, by the address that it printed."""

    def __init__(self, address, timeout_s=30):
        self.host, self.port, self._token = parse_address(address)
        self.address = address.strip()
        self.timeout_s = timeout_s

    def is_same_as(self, other):
        """Whether the same running program answers both: another one has another token."""
        return (self.port, self._token) == (other.port, other._token)

    def request(self, method, path, body=None):
        """The bytes of the answer."""
        headers = {"Authorization": f"Bearer {self._token}"}
        if body is not None:
            body = json.dumps(body)
            headers["Content-Type"] = "application/json"
        connection = http.client.HTTPConnection(self.host, self.port, timeout=self.timeout_s)
        try:
            connection.request(method, path, body, headers)
            answer = connection.getresponse()
            data = answer.read()
        except (OSError, http.client.HTTPException) as error:
            raise StudioError(f"no studio answers at {self.host}:{self.port}: {error}") from error
        finally:
            connection.close()
        if answer.status != 200:
            raise StudioRefused(self._reason(answer.status, data), answer.status)
        return data

    @staticmethod
    def _reason(status, data):
        try:
            return json.loads(data)["error"]
        except (ValueError, KeyError, TypeError):
            return f"the studio answered {status}"

    def state(self):
        try:
            return json.loads(self.request("GET", "/api/state"))
        except ValueError as error:
            raise StudioError(f"what answers at {self.host}:{self.port} is no studio") from error

    def wait(self, timeout_s=600):
        """Until the volume is read and nothing is computed; the state, whose "error" is that of the
        last thing that failed. Raises StudioError if no volume is opened."""
        end = time.monotonic() + timeout_s
        while True:
            state = self.state()
            if state["job"] is None and state["volume"] is not None:
                return state
            if state["job"] is None and state["error"]:
                raise StudioError(state["error"]["text"])
            if state["job"] is None and any(len(f.get("series") or []) > 1 for f in state["files"]):
                raise StudioError("the folder holds several series: open one of them")
            if time.monotonic() > end:
                raise StudioError(f"after {timeout_s} s the volume is not open or something is "
                                  "still computed")
            time.sleep(0.02)

    def do(self, action, **what):
        return json.loads(self.request("POST", "/api/do", {"action": action, **what}))

    def surface(self, object_id):
        return parse_surface(self.request("GET", f"/api/surface?object={int(object_id)}"))

    def export(self, what, object_id, name, file_format="", space="lps", overwrite=False):
        """Writes into the studio's folder; the name and the number of bytes."""
        return json.loads(self.request("POST", "/api/export", {
            "what": what, "object": object_id, "format": file_format, "space": space, "name": name,
            "overwrite": overwrite}))

    def set_points(self, object_id, inside, outside, state=None):
        """Makes the object's clicks these points; the number of changes. What evolves then goes
        on by itself."""
        state = state or self.state()
        clicks = next((o["clicks"] for o in state["objects"] if o["id"] == object_id), None)
        if clicks is None:
            raise StudioError(f"the studio has no object {object_id}")
        actions = changes([(c["side"], tuple(c["point"])) for c in clicks],
                          [("inside", tuple(p)) for p in inside] +
                          [("outside", tuple(p)) for p in outside])
        for action in actions:
            self.do(object=object_id, **action)
        return len(actions)


class SurfaceWatch:
    """Fetches an object's surface when it is another one, also while it evolves."""

    def __init__(self, studio, object_id):
        self.studio = studio
        self.object_id = object_id
        self._seen = None
        self._had = False

    def poll(self, state):
        """The new surface, "gone" if there is none any more, or None if nothing has changed. What a
        studio keeps of an object that has no click any more does not count."""
        found = next((o for o in state["objects"] if o["id"] == self.object_id), None)
        job = state["job"]
        is_evolving = job is not None and job["object"] == self.object_id
        has = found is not None and found["has_surface"] and bool(found["clicks"])
        frame = job["frame"] if is_evolving else 0
        mark = (has, found["surface"] if has else 0, job["id"] if frame else 0, frame)
        if mark == self._seen:
            return None
        if not has and not frame:
            if is_evolving:
                return None  # what is seen stays until there is something newer
            had, self._seen, self._had = self._had, mark, False
            return "gone" if had else None
        try:
            surface = self.studio.surface(self.object_id)
        except StudioRefused:
            return None  # between two states; the next poll sees what came of it
        # Of a frame that came after the state the next state tells: it need not be fetched again.
        self._seen, self._had = (*mark[:3], surface.frame), True
        return surface


class StudioProcess:
    """`surfseg studio` started for one volume; it ends with end(), or with its `with` block. The
    volume is read meanwhile: studio.wait()."""

    def __init__(self, program, volume_path, environment=None):
        found = shutil.which(program)
        if not found:
            raise StudioError(f"{program}: there is no such program; say where surfseg is")
        folder, name = os.path.split(os.path.abspath(volume_path))
        try:
            self._process = subprocess.Popen(
                [os.path.abspath(found), "studio", "--no-open", name], cwd=folder, text=True,
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                env=environment)
        except OSError as error:
            raise StudioError(f"{program}: cannot be run: {error}") from error
        self._errors = []
        self._reader = threading.Thread(target=self._read_errors, daemon=True)
        self._reader.start()
        address = self._process.stdout.readline()
        if not address:
            self._process.wait(20)
            self._reader.join(20)
            self._process.stdout.close()
            raise StudioError(self._errors[-1] if self._errors else f"{program}: ended at once")
        self.studio = Studio(address)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.end()

    def _read_errors(self):
        with self._process.stderr as stream:  # a full pipe would hold the studio up
            for line in stream:
                self._errors = self._errors[-20:] + [line.strip()]

    def is_running(self):
        return self._process.poll() is None

    def end(self):
        if self.is_running():
            self._process.terminate()
        try:
            self._process.wait(20)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join(20)
        self._process.stdout.close()


def environment_without_slicer(environment):
    """Slicer's own libraries stay out of the way of surfseg's: what its launcher has put before
    the paths is dropped."""
    home = environment.get("SLICER_HOME", "")
    out = {}
    for name, value in environment.items():
        if home and name in ("LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "PATH", "PYTHONPATH",
                             "QT_PLUGIN_PATH"):
            value = os.pathsep.join(p for p in value.split(os.pathsep) if not p.startswith(home))
            if not value:
                continue
        if home and name == "PYTHONHOME":
            continue
        out[name] = value
    return out
