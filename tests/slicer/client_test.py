#!/usr/bin/python3
"""The Slicer module's client against a real, running `surfseg studio`."""
import os
import random
import shutil
import struct
import subprocess
import sys
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.path[:0] = [os.path.join(ROOT, "tests", "studio"), os.path.join(ROOT, "tools", "slicer", "SurfsegStudio")]

from studio import folder_with  # noqa: E402
from SurfsegStudioLib import client  # noqa: E402

BALLS = ("balls.nii.gz", "separate-balls", "--size", "40", "--spacing", "1", "--noise", "0.05")
LEFT, RIGHT = (-9.75, 0, 0), (9.75, 0, 0)


def volume_ml(surface):
    """That the triangles enclose, by their signed cones."""
    p, total = surface.points, 0
    for n in range(surface.n_triangles):
        a, b, c = (p[3 * v:3 * v + 3] for v in surface.triangles[3 * n:3 * n + 3])
        total += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                  a[2] * (b[0] * c[1] - b[1] * c[0]))
    return total / 6000


def centre(surface):
    return [sum(surface.points[axis::3]) / surface.n_points for axis in range(3)]


class WithStudio(unittest.TestCase):
    def setUp(self):
        self.folder = folder_with(BALLS)
        self.process = client.StudioProcess(os.environ["SURFSEG_PROGRAM"],
                                            os.path.join(self.folder, "balls.nii.gz"))
        self.studio = self.process.studio
        self.idle()
        self.object = self.studio.state()["objects"][0]["id"]

    def tearDown(self):
        self.process.end()
        shutil.rmtree(self.folder)

    def idle(self):
        return self.studio.wait(120)


class Client(WithStudio):
    def test_shows_the_surface_of_points_that_come_move_and_go(self):
        self.assertEqual(self.studio.set_points(self.object, [LEFT], []), 1)
        state = self.idle()
        surface = self.studio.surface(self.object)
        measures = state["objects"][0]["measures"]
        self.assertEqual((surface.n_points, surface.n_triangles, surface.frame),
                         (measures["vertices"], measures["triangles"], 0))
        self.assertAlmostEqual(volume_ml(surface), measures["volume_ml"], 3)  # outward, and RAS mm
        self.assertLess(max(abs(a - b) for a, b in zip(centre(surface), LEFT)), 0.5)
        self.assertEqual([len(values) for values in surface.arrays], [surface.n_points] * 2)

        self.assertEqual(self.studio.set_points(self.object, [LEFT], []), 0)
        self.assertEqual(self.studio.set_points(self.object, [RIGHT], []), 1)  # moved
        self.idle()
        self.assertLess(max(abs(a - b) for a, b in zip(centre(self.studio.surface(self.object)), RIGHT)), 0.5)

        self.assertEqual(self.studio.set_points(self.object, [LEFT, RIGHT], [(0, 9, 0)]), 2)
        clicks = self.idle()["objects"][0]["clicks"]
        self.assertEqual([(c["side"], tuple(c["point"])) for c in clicks],
                         [("inside", RIGHT), ("inside", LEFT), ("outside", (0, 9, 0))])
        self.assertAlmostEqual(volume_ml(self.studio.surface(self.object)), 2 * measures["volume_ml"], 1)

        self.assertEqual(self.studio.set_points(self.object, [], []), 3)
        self.assertEqual(self.idle()["objects"][0]["clicks"], [])

    def test_two_of_three_points_that_move_at_once_go_where_they_are_wanted(self):
        one, two, three = LEFT, (-9.75, 2, 0), (-9.75, 0, 2)
        self.studio.set_points(self.object, [one, two, three], [])
        moved = [(-8, 1, 0), two, (-8, 0, -1)]
        self.assertEqual(self.studio.set_points(self.object, moved, []), 2)
        clicks = self.idle()["objects"][0]["clicks"]
        self.assertEqual([tuple(c["point"]) for c in clicks], [two, moved[0], moved[2]])
        self.assertEqual(self.studio.set_points(self.object, [two, (-8, 0, 1)], []), 2)  # one went, one moved
        clicks = self.idle()["objects"][0]["clicks"]
        self.assertEqual([tuple(c["point"]) for c in clicks], [two, (-8, 0, 1)])

    def test_what_the_page_did_meanwhile_is_no_reason_to_take_another_click(self):
        one, two, three = LEFT, (-9.75, 2, 0.1), (-9.75, 0, 2)
        self.studio.set_points(self.object, [one, two, three], [])
        seen = self.idle()
        self.studio.do("delete_click", object=self.object, index=0)
        for wanted in ([one, (-8, 1, 0), three], [one, three]):
            with self.assertRaisesRegex(client.StudioRefused, "not where it was") as refused:
                self.studio.set_points(self.object, wanted, [], state=seen)
            self.assertEqual(refused.exception.status, 409)
            clicks = self.idle()["objects"][0]["clicks"]
            self.assertEqual([tuple(c["point"]) for c in clicks], [two, three])
        self.assertEqual(self.studio.set_points(self.object, [two], []), 1)  # by a state of its own

    def until_it_has_evolved(self, watch):
        """The surfaces that are new meanwhile, and the state at the end."""
        seen, end = [], time.time() + 120
        while time.time() < end:
            state = self.studio.state()
            new = watch.poll(state)
            if new is not None:
                seen.append(new)
            if state["job"] is None and seen:
                break
        return seen, state

    def test_watches_it_while_it_evolves(self):
        # Finer until it is seen on its way: a machine may be so fast or so busy that nobody looks in time.
        for edge_length in (0.6, 0.4, 0.3, 0.25, 0.2):
            watch = client.SurfaceWatch(self.studio, self.object)
            self.studio.do("set_options", object=self.object,
                           options={"edge_length_mm": edge_length, "coarseness": 1})
            self.assertIsNone(watch.poll(self.studio.state()))
            self.studio.set_points(self.object, [LEFT], [])
            seen, state = self.until_it_has_evolved(watch)
            frames = [surface.frame for surface in seen if surface.frame > 0]
            if frames:
                break
            self.studio.set_points(self.object, [], [])
        self.assertNotIn("gone", seen)
        self.assertTrue(frames, "the surface is seen while it evolves")
        self.assertEqual(sorted(set(frames)), frames, "each frame once")
        self.assertEqual(seen[-1].frame, 0)
        self.assertEqual(seen[-1].n_triangles, state["objects"][0]["measures"]["triangles"])
        self.assertIsNone(watch.poll(self.studio.state()))
        self.studio.set_points(self.object, [], [])
        self.assertEqual(watch.poll(self.idle()), "gone")
        self.assertIsNone(watch.poll(self.studio.state()))

    def test_says_in_one_line_what_was_refused(self):
        with self.assertRaisesRegex(client.StudioRefused, "outside the volume"):
            self.studio.set_points(self.object, [(900, 0, 0)], [])
        with self.assertRaisesRegex(client.StudioError, "no object 7"):
            self.studio.set_points(7, [LEFT], [])
        with self.assertRaisesRegex(client.StudioRefused, "has no surface"):
            self.studio.surface(self.object)
        stranger = client.Studio(self.studio.address[:-4] + "0000")
        with self.assertRaisesRegex(client.StudioRefused, "no token"):
            stranger.state()
        self.assertEqual(self.studio.set_points(self.object, [LEFT], []), 1)  # and it goes on

    def test_exports_and_repeats_to_the_byte(self):
        self.studio.set_points(self.object, [LEFT], [])
        self.idle()
        made = self.studio.export("surface", self.object, "left.stl", "stl")
        self.assertEqual(os.path.getsize(os.path.join(self.folder, "left.stl")), made["bytes"])
        subprocess.run([os.environ["SURFSEG_PROGRAM"], "replay", "balls.nii.gz.surfseg.json", "-o", "again.stl",
                        "-q"], cwd=self.folder, check=True)
        content = [open(os.path.join(self.folder, name), "rb") for name in ("left.stl", "again.stl")]
        with content[0] as one, content[1] as two:
            self.assertEqual(one.read(), two.read())

    def test_ends_the_studio_that_it_started(self):
        self.assertTrue(self.process.is_running())
        self.process.end()
        self.assertFalse(self.process.is_running())
        with self.assertRaisesRegex(client.StudioError, "no studio answers at 127.0.0.1:"):
            self.studio.state()


class Starting(unittest.TestCase):
    def test_says_why_it_could_not(self):
        with self.assertRaisesRegex(client.StudioError, "there is no such program"):
            client.StudioProcess("no-such-surfseg", "v.nrrd")
        with self.assertRaisesRegex(client.StudioError, "gone.nrrd"):
            client.StudioProcess(os.environ["SURFSEG_PROGRAM"], os.path.join(HERE, "gone.nrrd"))

    def test_waits_for_a_volume_and_says_why_there_is_none(self):
        folder = folder_with(BALLS)
        try:
            with client.StudioProcess(os.environ["SURFSEG_PROGRAM"],
                                      os.path.join(folder, "balls.nii.gz")) as process:
                self.assertEqual(len(process.studio.wait()["objects"]), 1)
            self.assertFalse(process.is_running())
            with open(os.path.join(folder, "empty.nii.gz"), "wb"):
                pass
            with client.StudioProcess(os.environ["SURFSEG_PROGRAM"],
                                      os.path.join(folder, "empty.nii.gz")) as process:
                with self.assertRaisesRegex(client.StudioError, "empty.nii.gz"):
                    process.studio.wait()
        finally:
            shutil.rmtree(folder)

    def test_drops_what_slicer_put_before_the_paths(self):
        clean = client.environment_without_slicer(
            {"SLICER_HOME": "/opt/Slicer", "LD_LIBRARY_PATH": "/opt/Slicer/lib:/usr/local/lib",
             "PYTHONHOME": "/opt/Slicer/lib/Python", "PYTHONPATH": "/opt/Slicer/a:/opt/Slicer/b",
             "HOME": "/home/someone"})
        self.assertEqual(clean, {"SLICER_HOME": "/opt/Slicer", "LD_LIBRARY_PATH": "/usr/local/lib",
                                 "HOME": "/home/someone"})
        self.assertEqual(client.environment_without_slicer({"PYTHONPATH": "/a"}), {"PYTHONPATH": "/a"})


class WithoutStudio(unittest.TestCase):
    def test_reads_addresses(self):
        self.assertEqual(client.parse_address(" http://127.0.0.1:8911/?token=ab12\n"), ("127.0.0.1", 8911, "ab12"))
        for wrong in ("", "8911", "http://127.0.0.1:8911/", "http://127.0.0.1/?token=a",
                      "https://127.0.0.1:8911/?token=a", "http://127.0.0.1:x/?token=a",
                      "http://example.org:80/?token=a"):
            with self.assertRaises(client.StudioError, msg=wrong):
                client.parse_address(wrong)

    def test_knows_the_same_program_by_its_token(self):
        one = client.Studio("http://127.0.0.1:8911/?token=ab")
        self.assertTrue(one.is_same_as(client.Studio("http://localhost:8911/?token=ab")))
        self.assertFalse(one.is_same_as(client.Studio("http://127.0.0.1:8911/?token=cd")))

    def test_reads_surfaces(self):
        head = struct.pack("<4I", 3, 1, 1, 5)
        body = struct.pack("<9f", *range(9)) + struct.pack("<3I", 0, 1, 2) + struct.pack("<3f", 7, 8, 9)
        surface = client.parse_surface(head + body)
        self.assertEqual((list(surface.points), list(surface.triangles), list(surface.arrays[0]), surface.frame),
                         (list(range(9)), [0, 1, 2], [7, 8, 9], 5))
        wild = struct.pack("<9f", *range(9)) + struct.pack("<3I", 0, 1, 3) + struct.pack("<3f", 7, 8, 9)
        for wrong in (b"", head, head + body[:-1], head + body + b"x", head + wild):
            with self.assertRaises(client.StudioError):
                client.parse_surface(wrong)

    def test_finds_clicks_that_are_no_points(self):
        clicks = [{"side": "inside", "point": [1, 0, 0]}, {"side": "inside", "point": [2, 0, 0]},
                  {"side": "outside", "point": [2, 0, 0]}]
        self.assertEqual(client.lacking(clicks, "inside", [(2.00000001, 0, 0)]), [[1, 0, 0]])
        self.assertEqual(client.lacking(clicks, "outside", []), [[2, 0, 0]])

    def test_finds_the_fewest_changes(self):
        one, two, three, far = ("inside", (1, 0, 0)), ("inside", (2, 0, 0)), ("outside", (3, 0, 0)), (9.0, 9.0, 9.0)
        click = lambda side, point: {"action": "click", "side": side, "point": list(point)}  # noqa: E731
        self.assertEqual(client.changes([one, three], [three, one]), [])
        self.assertEqual(client.changes([], [three, one]), [click(*one), click(*three)])
        self.assertEqual(client.changes([one, two, three], [("inside", far), two, three]),
                         [{"action": "move_click", "index": 0, "was": [1, 0, 0], "point": list(far)}])
        delete = lambda index, one: {"action": "delete_click", "index": index, "was": list(one[1])}  # noqa: E731
        self.assertEqual(client.changes([one, two, three], [two]), [delete(0, one), delete(1, three)])
        self.assertEqual(client.changes([one, three], [one, ("inside", far)]),
                         [delete(1, three), click("inside", far)])
        self.assertEqual(client.changes([one], [("inside", (1.00000001, 0, 0))]), [])

    def test_changes_make_the_clicks_those_that_are_wanted(self):
        def done(clicks, actions):
            """As the studio does them."""
            clicks = list(clicks)
            for a in actions:
                if a["action"] == "click":
                    side = a["side"]
                else:
                    side, was = clicks.pop(a["index"])
                    self.assertEqual(list(was), a["was"])
                if a["action"] != "delete_click":
                    clicks.append((side, tuple(a["point"])))
            return clicks

        draw = random.Random(1)
        pool = [(side, (float(x), 0.0, 0.0)) for side in ("inside", "outside") for x in range(6)]
        for _ in range(500):
            clicks, wanted = (draw.sample(pool, draw.randrange(9)) for _ in range(2))
            actions = client.changes(clicks, wanted)
            self.assertEqual(sorted(done(clicks, actions)), sorted(wanted), (clicks, actions))
        two = client.changes([("inside", (0, 0, 0)), ("inside", (1, 0, 0)), ("inside", (2, 0, 0))],
                             [("inside", (5, 0, 0)), ("inside", (1, 0, 0)), ("inside", (6, 0, 0))])
        self.assertEqual([(a["action"], a["index"], a["point"][0]) for a in two],
                         [("move_click", 0, 5), ("move_click", 1, 6)])


if __name__ == "__main__":
    unittest.main()
