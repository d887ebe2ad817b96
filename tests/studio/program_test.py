#!/usr/bin/python3
"""surfseg studio as a program: what it keeps, opens and refuses, how it ends, and ITK-SNAP as its client. No browser."""
import array
import base64
import contextlib
import gzip
import json
import math
import os
import shutil
import signal
import subprocess
import unittest

from studio import BALLS, LEFT, RIGHT, Studio, content, folder_with, phantom

# The finer a surface, the longer it is made.
FINER = [{"edge_length_mm": edge_length, "coarseness": 1} for edge_length in (0.03, 0.02, 0.015, 0.0125, 0.01)]


@contextlib.contextmanager
def caught(look, folder, *words):
    """A studio, and what `look` has seen of what passes by in it. Nothing: the machine was too fast or too busy, and another
    studio is looked at."""
    for _ in range(10):
        with Studio(folder, *words) as studio:
            if seen := look(studio):
                yield studio, seen
                return
    raise AssertionError("it was never seen")


class KeptState(unittest.TestCase):
    def test_after_a_kill_it_opens_where_it_was(self):
        folder = folder_with(BALLS)
        studio = Studio(folder, "balls.nii.gz")
        studio.until(lambda s: s["volume"] and s["job"] is None)
        studio.click(LEFT)
        one = studio.idle()["objects"][0]
        studio.click(RIGHT)  # killed amid its evolution
        studio.process.send_signal(signal.SIGKILL)
        studio.process.wait()
        with Studio(folder, "balls.nii.gz") as again:
            again.until(lambda s: s["volume"] and s["job"] is None)
            state = again.state()["objects"][0]
            self.assertEqual([c["point"] for c in state["clicks"]], [list(LEFT), list(RIGHT)])
            again.do("undo", object=1)
            self.assertEqual(again.idle()["objects"][0]["measures"], one["measures"])
        studio.process.stdout.close()
        studio.process.stderr.close()
        shutil.rmtree(folder)

    def test_it_opens_at_once_and_makes_surfaces_again_from_what_they_need(self):
        folder = folder_with(BALLS)
        with Studio(folder, "balls.nii.gz") as studio:
            studio.until(lambda s: s["volume"] and s["job"] is None)
            studio.do("set_options", object=1, options=FINER[0])
            studio.click(LEFT)
            one = studio.idle()["objects"][0]
            studio.click(RIGHT)
            two = studio.idle()["objects"][0]
            studio.do("add_object")
        history = json.loads(content(folder, "balls.nii.gz.surfseg.json"))["objects"][0]["history"]
        self.assertEqual([a["do"] for a in history if a.get("anew")], ["evolve"],
                         "a further click amends what is there")

        def opened_before_it_was_made(studio):
            state = studio.until(lambda s: s["volume"])
            return state if state["job"] and state["job"]["object"] == 1 else None

        with caught(opened_before_it_was_made, folder, "balls.nii.gz") as (again, opened):
            self.assertEqual(len(opened["objects"]), 2)
            self.assertEqual(opened["objects"][0]["clicks"], two["clicks"], "clicks are there with the volume")
            self.assertFalse(opened["objects"][0]["has_surface"], "its surface is on its way")
            again.export(what="recipe", name="kept.json")
            self.assertEqual(json.loads(content(folder, "kept.json"))["objects"][0]["history"], history)
            self.assertEqual(again.idle()["objects"][0]["measures"], two["measures"])
            again.do("undo", object=1)
            self.assertEqual(again.idle()["objects"][0]["measures"], one["measures"])
            again.do("redo", object=1)
            self.assertEqual(again.idle()["objects"][0]["measures"], two["measures"])
        shutil.rmtree(folder)

    def test_a_click_that_was_waiting_evolves_after_opening(self):
        folder = folder_with(BALLS)
        studio = Studio(folder, "balls.nii.gz")
        studio.until(lambda s: s["volume"] and s["job"] is None)
        studio.click(LEFT)  # killed before it has evolved
        studio.process.send_signal(signal.SIGKILL)
        studio.process.wait()
        studio.process.stdout.close()
        studio.process.stderr.close()
        with Studio(folder, "balls.nii.gz") as again:
            self.assertEqual(again.idle()["objects"][0]["outcome"], "converged")
        shutil.rmtree(folder)

    def test_a_broken_or_foreign_state_is_moved_aside(self):
        folder = folder_with(BALLS, ("other.nii.gz", "ball", "--size", "24"))
        with Studio(folder, "other.nii.gz") as studio:
            studio.until(lambda s: s["volume"] and s["job"] is None)
            studio.click((0, 0, 0))
            studio.idle()
        kept = os.path.join(folder, "balls.nii.gz.surfseg.json")
        for text in (content(folder, "other.nii.gz.surfseg.json"), b"{ no JSON", b""):
            with open(kept, "wb") as file:
                file.write(text)
            with Studio(folder, "balls.nii.gz") as studio:
                state = studio.until(lambda s: s["volume"] and s["job"] is None and s["error"])
                aside = state["error"]["text"].split()[-1]
                self.assertEqual(content(folder, aside), text)
                self.assertEqual(len(state["objects"]), 1)
        shutil.rmtree(folder)

    def test_a_scan_whose_state_cannot_be_looked_for_is_not_open(self):
        folder = folder_with(BALLS, ("ball.nrrd", "ball", "--size", "16"))
        kept = os.path.join(folder, "balls.nii.gz.surfseg.json")
        os.symlink(kept, kept)  # leads nowhere
        with Studio(folder, "balls.nii.gz") as studio:
            state = studio.until(lambda s: s["error"] and s["job"] is None)
            self.assertIn(os.path.basename(kept), state["error"]["text"])
            self.assertIsNone(state["volume"])
            self.assertIn("no volume is open", studio.export(400, what="recipe", name="a.json")["error"])
            studio.do("open", path="ball.nrrd")
            state = studio.until(lambda s: s["volume"] and s["job"] is None)
            self.assertEqual(len(state["objects"]), 1)
        shutil.rmtree(folder)

    def test_a_state_that_is_a_link_out_of_the_folder_is_not_written(self):
        top = folder_with()
        folder, elsewhere = os.path.join(top, "scans"), os.path.join(top, "elsewhere")
        os.mkdir(folder)
        phantom(folder, *BALLS)
        kept = os.path.join(folder, "balls.nii.gz.surfseg.json")
        os.symlink("../elsewhere", kept)
        with Studio(folder, "balls.nii.gz") as studio:
            studio.until(lambda s: s["volume"] and s["job"] is None)
            studio.click(LEFT)
            state = studio.idle()
            self.assertFalse(os.path.exists(elsewhere))
            self.assertTrue(state["objects"][0]["has_surface"])
            self.assertIn("the state is not kept: balls.nii.gz.surfseg.json is a link that leads out of the folder",
                          state["error"]["text"])
            studio.export(what="recipe", name="other.json")
        shutil.copy(os.path.join(folder, "other.json"), elsewhere)  # now it can be read, and stays as it is
        with Studio(folder, "balls.nii.gz") as studio:
            studio.until(lambda s: s["volume"] and s["job"] is None)
            studio.idle()
            studio.click(RIGHT)
            self.assertIn("the state is not kept", studio.idle()["error"]["text"])
        self.assertEqual(content(top, "elsewhere"), content(folder, "other.json"))
        self.assertEqual(sorted(os.listdir(top)), ["elsewhere", "scans"])
        os.remove(kept)
        os.symlink("here", kept)
        with Studio(folder, "balls.nii.gz") as studio:
            studio.until(lambda s: s["volume"] and s["job"] is None)
            studio.click(LEFT)
            self.assertIsNone(studio.idle()["error"])
        self.assertTrue(os.path.exists(os.path.join(folder, "here")))
        shutil.rmtree(top)

    def test_a_recipe_names_no_folder_above(self):
        folder = folder_with(BALLS)
        with Studio(folder, "balls.nii.gz") as studio:
            studio.until(lambda s: s["volume"] and s["job"] is None)
            studio.export(what="recipe", name="above.json")
            recipe = json.loads(content(folder, "above.json"))
            for name in ("..", ".", "/", "x/", "x/.."):
                recipe["image"]["path"] = name
                with open(os.path.join(folder, "above.json"), "w") as file:
                    json.dump(recipe, file)
                before = studio.state()["error"]
                studio.do("open", path="above.json")
                state = studio.until(lambda s: s["error"] != before and s["job"] is None)
                self.assertIn("is not beside it", state["error"]["text"])
        shutil.rmtree(folder)

    def test_what_waits_to_be_made_again_is_made_after_a_stop(self):
        folder = folder_with(("balls.nii.gz", "separate-balls", "--size", "64", "--noise", "0.05"))
        with Studio(folder, "balls.nii.gz") as studio:
            studio.until(lambda s: s["volume"] and s["job"] is None)
            studio.do("add_object", name="right")
            for number, point in ((1, LEFT), (2, RIGHT)):
                studio.do("set_options", object=number, options=FINER[0])
                studio.click(point, object=number)
                before = studio.idle()["objects"]

        def stopped_amid(number):
            """Ends the making of this object; what an export was told before, and the objects afterwards."""
            finer = iter(FINER[1:])

            def look(studio):
                studio.until(lambda s: s["volume"] and (
                    s["job"] is None or (s["job"]["what"], s["job"]["object"]) == ("repeat", number)))
                _, said, _ = studio.request("POST", "/api/export", {"what": "surface", "object": number, "name": "early.stl",
                                                                    "overwrite": True})
                studio.do("stop")
                objects = studio.until(lambda s: s["job"] is None)["objects"]
                if not objects[number - 1]["has_surface"]:
                    return json.loads(said), objects
                studio.do("set_options", object=number, options=next(finer, FINER[-1]))  # it was made already
                studio.until(lambda s: s["job"] is None)
                return None

            return look

        with caught(stopped_amid(1), folder, "balls.nii.gz") as (again, (said, stopped)):
            self.assertIn("'object 1' is still being made again: wait until it is there", said["error"])
            self.assertEqual([o["has_surface"] for o in stopped], [False, True])
            self.assertEqual(stopped[1]["measures"], before[1]["measures"])
            again.export(what="picture", object=2, name="right.png")  # needs no other
            for what, name in (("surface", "a.stl"), ("measures", "a.csv"), ("report", "a.html")):
                for number in (1, 2):  # the second ends where the first begins
                    self.assertIn("'object 1' has no surface yet, since its making was stopped: G makes it",
                                  again.export(400, what=what, object=number, name=name)["error"])
            again.do("evolve", object=1)
            again.idle()
            again.export(what="surface", object=1, name="a.stl")
        with caught(stopped_amid(2), folder, "balls.nii.gz") as (again, (said, stopped)):
            self.assertIn("'right' is still being made again", said["error"])
            self.assertEqual([o["has_surface"] for o in stopped], [True, False])
            again.export(what="surface", object=1, name="b.stl")  # what comes after it takes nothing of it
            self.assertIn("'right' has no surface yet", again.export(400, what="labels", name="b.nii.gz")["error"])
        shutil.rmtree(folder)

    def test_a_preset_leaves_where_the_object_lies(self):
        folder = folder_with(BALLS)
        subprocess.run([os.environ["SURFSEG_PROGRAM"], "segment", "balls.nii.gz", "--seed=-0.5,0,0", "--edge-length", "0.1mm",
                        "--box=-0.95,-0.6,-0.6,-0.05,0.6,0.6", "--recipe", "boxed.json", "-o", "boxed.stl", "-q"],
                       cwd=folder, check=True)
        recipe = json.loads(content(folder, "boxed.json"))
        first = recipe["objects"][0]["history"][0]
        first["options"]["samples_mm"] = [[-0.5, 0, 0]]
        with open(os.path.join(folder, "boxed.json"), "w") as file:
            json.dump(recipe, file)
        with Studio(folder, "boxed.json") as studio:
            studio.until(lambda s: s["volume"] and s["job"] is None)
            studio.do("preset", object=1, name="kidney-ct")
            studio.do("stop")
            state = studio.until(lambda s: s["job"] is None)
            self.assertNotIn("edge_length_mm", state["objects"][0]["options"])
        done = [a for a in json.loads(content(folder, "boxed.json"))["objects"][0]["history"] if a["do"] == "options"]
        self.assertEqual(len(done), 2)
        for key in ("box_mm", "samples_mm"):
            self.assertEqual(done[1]["options"][key], first["options"][key])
        shutil.rmtree(folder)

    def test_errors_and_volumes_of_the_next_program_have_other_numbers(self):
        folder = folder_with(BALLS)
        with open(os.path.join(folder, "broken.nii"), "w") as file:
            file.write("no volume")
        numbers, volumes = [], []
        for _ in range(2):
            with Studio(folder) as studio:
                for _ in range(2):
                    before = studio.state()["error"]
                    studio.do("open", path="broken.nii")
                    numbers.append(studio.until(lambda s: s["error"] != before and s["job"] is None)["error"]["id"])
                for _ in range(2):
                    studio.do("open", path="balls.nii.gz")
                    volumes.append(studio.until(lambda s: s["volume"] and s["volume"]["revision"] not in volumes)["volume"]["revision"])
        self.assertEqual(numbers, sorted(set(numbers)))
        self.assertEqual(volumes, sorted(set(volumes)))
        shutil.rmtree(folder)

    def test_a_recipe_under_another_name_keeps_its_name_and_leaves_the_state_of_the_scan(self):
        folder = folder_with(BALLS)
        with Studio(folder, "balls.nii.gz") as studio:
            studio.until(lambda s: s["volume"] and s["job"] is None)
            studio.click(LEFT)
            studio.idle()
            studio.export(what="recipe", name="first.json")
            studio.click(RIGHT)
            studio.idle()
        scans = content(folder, "balls.nii.gz.surfseg.json")
        with Studio(folder, "first.json") as studio:
            studio.until(lambda s: s["volume"] and s["job"] is None)
            opened = studio.idle()
            self.assertEqual(opened["volume"]["kept_in"], "first.json")
            self.assertEqual(opened["volume"]["notes"], ["what is done is kept in first.json, which was opened; "
                                                         "balls.nii.gz.surfseg.json stays as it is"])
            self.assertEqual(len(opened["objects"][0]["clicks"]), 1)
            studio.do("rename", object=1, name="left")
            studio.idle()
            self.assertEqual(content(folder, "balls.nii.gz.surfseg.json"), scans)
            self.assertIn(b'"left"', content(folder, "first.json"))
            studio.do("open", path="balls.nii.gz")
            state = studio.until(lambda s: s["volume"] and s["volume"]["revision"] > opened["volume"]["revision"] and s["job"] is None)
            self.assertEqual((state["volume"]["kept_in"], state["volume"]["notes"]), ("balls.nii.gz.surfseg.json", []))
            self.assertEqual(len(state["objects"][0]["clicks"]), 2)
        os.remove(os.path.join(folder, "balls.nii.gz.surfseg.json"))
        with Studio(folder, "first.json") as studio:
            state = studio.until(lambda s: s["volume"] and s["job"] is None)
            self.assertEqual(state["volume"]["notes"], ["what is done is kept in first.json, which was opened"])
        self.assertFalse(os.path.exists(os.path.join(folder, "balls.nii.gz.surfseg.json")))
        shutil.rmtree(folder)

    def test_it_says_what_it_reads(self):
        folder = folder_with()
        slow = os.path.join(folder, "slow.nii.gz")
        os.mkfifo(slow)  # is read until whoever writes it has ended

        def is_read(state):
            with contextlib.suppress(OSError):  # nobody reads it yet, or it is gone
                end = os.open(slow, os.O_WRONLY | os.O_NONBLOCK)
                os.remove(slow)
                os.close(end)
            return state["error"] and state["job"] is None

        with Studio(folder, "slow.nii.gz") as studio:
            job = studio.until(lambda s: s["job"] or s["error"])["job"]
            studio.until(is_read)
        self.assertIsNotNone(job)
        self.assertEqual((job["what"], job["stage"]), ("open", "reading slow.nii.gz"))
        shutil.rmtree(folder)

    def test_a_folder_lists_what_can_be_opened(self):
        folder = folder_with(BALLS, ("ball.nrrd", "ball", "--size", "16"))
        with open(os.path.join(folder, "notes.txt"), "w") as file:
            file.write("no volume")
        with open(os.path.join(folder, "broken.nii"), "w") as file:
            file.write("no volume")
        with Studio(folder) as studio:
            self.assertEqual([f["path"] for f in studio.state()["files"]], ["ball.nrrd", "balls.nii.gz", "broken.nii"])
            studio.click(LEFT, expect=400)
            studio.do("open", path="broken.nii")
            state = studio.until(lambda s: s["error"] and s["job"] is None)
            self.assertIn("broken.nii", state["error"]["text"])
            studio.do("open", path="ball.nrrd")
            self.assertEqual(studio.until(lambda s: s["volume"] and s["job"] is None)["volume"]["path"], "ball.nrrd")
            studio.click((0, 0, 0))
            studio.idle()
            studio.do("open", path="balls.nii.gz")
            studio.until(lambda s: s["volume"] and s["volume"]["path"] == "balls.nii.gz" and s["job"] is None)
            studio.do("open", path="ball.nrrd.surfseg.json")
            state = studio.until(lambda s: s["volume"] and s["volume"]["path"] == "ball.nrrd" and s["job"] is None)
            self.assertEqual(len(state["objects"][0]["clicks"]), 1)
        shutil.rmtree(folder)


class ItkSnap(unittest.TestCase):
    """What ITK-SNAP 4.4's client sends, sent here: no ITK-SNAP is needed."""

    SIZE, SPACING, ORIGIN = (32, 28, 24), (1.0, 1.2, 1.5), (-10.0, 5.0, 3.0)
    DIRECTION = (0.8, -0.6, 0.0, 0.6, 0.8, 0.0, 0.0, 0.0, 1.0)  # row-major, LPS

    def image(self):
        """A ball of radius 8 mm about the voxel (16, 14, 12)."""
        values = array.array("f")
        for k in range(self.SIZE[2]):
            for j in range(self.SIZE[1]):
                for i in range(self.SIZE[0]):
                    d = math.dist((i * 1.0, j * 1.2, k * 1.5), (16.0, 14 * 1.2, 12 * 1.5)) - 8
                    values.append(100 / (1 + math.exp(min(4 * d, 50))))
        return values

    def upload(self, studio, path, values):
        metadata = {"dimensions": self.SIZE, "spacing": self.SPACING, "origin": self.ORIGIN, "direction": self.DIRECTION,
                    "components_per_pixel": 1, "component_type": "float32"}
        parts = [(b'name="file"; filename="upload.nii.gz"', gzip.compress(values.tobytes())),
                 (b'name="metadata"', json.dumps(metadata).encode())]
        body = b"".join(b"--x\r\nContent-Disposition: form-data; " + head + b"\r\n\r\n" + data + b"\r\n" for head, data in parts) + b"--x--\r\n"
        return studio.request("POST", path, body, {"Content-Type": "multipart/form-data; boundary=x"}, token=False)

    def test_its_clicks_give_our_object(self):
        folder = folder_with(BALLS)
        with Studio(folder, "--itksnap") as studio:
            def get(path, expect=200):
                status, body, _ = studio.request("GET", path, token=False)
                self.assertEqual(status, expect, (path, body))
                return json.loads(body)

            self.assertEqual(get("/status"), {"status": "ok", "version": "0.1.2"})
            self.assertEqual(get("/v2/models")["models"][0]["id"], "surfseg")
            session = get("/v2/start_session/surfseg")["session_id"]
            get(f"/v2/process_point_interaction/{session}?point=16&point=14&point=12&foreground=true", 400)
            self.assertEqual(self.upload(studio, f"/upload_raw/{session}?filename=upload.nii.gz", self.image())[0], 200)
            answer = get(f"/v2/process_point_interaction/{session}?point=16&point=14&point=12&foreground=true")
            mask = gzip.decompress(base64.b64decode(answer["result"]))
            self.assertEqual(len(mask), 32 * 28 * 24)
            inside = [value > 50 for value in self.image()]
            common = sum(1 for m, t in zip(mask, inside) if m and t)
            self.assertGreater(2 * common / (sum(mask) + sum(inside)), 0.98)
            get(f"/v2/process_point_interaction/{session}?point=99&point=14&point=12&foreground=true", 400)
            stroke = array.array("f", bytes(4 * len(mask)))
            stroke[16 + 32 * (14 + 28 * 12)] = stroke[17 + 32 * (14 + 28 * 12)] = 1
            get(f"/reset_interactions/{session}")
            status, body, _ = self.upload(studio, f"/process_scribble_interaction/{session}?foreground=true", stroke)
            self.assertEqual(gzip.decompress(base64.b64decode(json.loads(body)["result"])), mask)
            self.assertEqual(self.upload(studio, f"/process_scribble_interaction/{session}?foreground=true", stroke[:100])[0], 400)
            get(f"/v2/end_session/{session}")
            get(f"/reset_interactions/{session}", 400)
            # Still for programs of this machine alone, and nothing else without the token.
            self.assertEqual(studio.request("GET", "/status", headers={"Host": "evil.example"}, token=False)[0], 421)
            self.assertEqual(studio.request("GET", "/status", headers={"Origin": "null"}, token=False)[0], 403)
            self.assertEqual(studio.request("GET", "/api/state", token=False)[0], 401)
        with Studio(folder) as studio:
            self.assertEqual(studio.request("GET", "/status", token=False)[0], 401)
        shutil.rmtree(folder)


class Program(unittest.TestCase):
    def run_studio(self, *words):
        return subprocess.run([os.environ["SURFSEG_PROGRAM"], "studio", "--no-open", *words], capture_output=True, text=True, timeout=60)

    def test_what_cannot_be_opened(self):
        folder = folder_with()
        for words, code in ((["no-such.nii"], 3), ([folder], 3), (["--port", "0", folder], 2), (["--fast"], 2)):
            done = self.run_studio(*words)
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        shutil.rmtree(folder)

    def test_from_a_menu_it_starts_where_there_is_nothing_to_open(self):
        folder = folder_with()
        studio = Studio(folder)
        self.assertEqual(studio.state()["files"], [])
        self.assertIn("holds no volume", studio.end())
        shutil.rmtree(folder)

    def test_a_range_beyond_the_volume_and_a_name_that_no_file_has_are_refused(self):
        folder = folder_with(BALLS)
        with Studio(folder, "balls.nii.gz") as studio:
            studio.until(lambda s: s["volume"] and s["job"] is None)
            whole = studio.get("/api/volume.nii.gz")
            for asked, status, expected in (("bytes=99999999-", 416, b""), ("bytes=0-99999999", 206, whole), ("bytes=4-9", 206, whole[4:10])):
                self.assertEqual(studio.request("GET", "/api/volume.nii.gz", headers={"Range": asked})[:2], (status, expected), asked)
            studio.do("add_object", 400, name="a/b")
            studio.do("rename", 400, object=1, name="a/b")
        shutil.rmtree(folder)

    def test_a_port_that_is_taken(self):
        folder = folder_with(BALLS)
        with Studio(folder) as studio:
            done = self.run_studio("--port", str(studio.port), folder)
            self.assertEqual(done.returncode, 2)
            self.assertIn("taken", done.stderr)
        shutil.rmtree(folder)

    def test_without_a_browser_it_says_so_and_goes_on(self):
        folder, programs = folder_with(BALLS), folder_with()
        for words in ((), ("#!/bin/sh\nexit 3\n",)):  # none at all, and one that fails
            for text in words:
                with open(os.path.join(programs, "xdg-open"), "w") as file:
                    file.write(text)
                os.chmod(file.name, 0o755)
            studio = Studio(folder, opens_browser=True, environment={"PATH": programs + (":/bin" if words else "")})
            self.assertEqual(studio.state()["files"][0]["path"], "balls.nii.gz")
            for line in studio.process.stderr:
                if "no browser could be opened" in line:
                    break
            else:
                self.fail("it does not say so")
            studio.end()
        shutil.rmtree(folder)
        shutil.rmtree(programs)

    def test_the_browser_is_told_a_code_that_opens_once_and_has_a_session_of_its_own(self):
        folder, programs = folder_with(BALLS), folder_with()
        told = os.path.join(programs, "told")
        with open(os.path.join(programs, "xdg-open"), "w") as file:
            # The sixth word of stat is the session; told appears whole.
            file.write(f'#!/bin/sh\nread -r _ _ _ _ _ session _ < /proc/$$/stat\n'
                       f'echo "$session $1" > "{told}.new" && mv "{told}.new" "{told}"\n')
        os.chmod(file.name, 0o755)
        with Studio(folder, opens_browser=True, environment={"PATH": f"{programs}:/usr/bin:/bin"}) as studio:
            studio.until(lambda _: os.path.exists(told))
            session, address = content(programs, "told").decode().split()
            self.assertNotEqual(int(session), os.getsid(studio.process.pid), "the terminal's Ctrl-C is not for it")
            start = f"http://127.0.0.1:{studio.port}"
            self.assertEqual(address[:len(start)], start)
            self.assertNotIn(studio.token, address)
            status, _, headers = studio.request("GET", address[len(start):], token=False)
            self.assertEqual((status, headers["Location"]), (302, "/"))
            cookie = {"Cookie": headers["Set-Cookie"].split(";")[0]}
            self.assertEqual(studio.request("GET", "/api/state", headers=cookie, token=False)[0], 200)
            self.assertEqual(studio.request("GET", address[len(start):], token=False)[0], 401, "once")
            self.assertEqual(studio.request("GET", "/?token=" + studio.token, token=False)[0], 302, "again and again")
        shutil.rmtree(folder)
        shutil.rmtree(programs)

    def test_ctrl_c_and_quit_end_it(self):
        folder = folder_with(BALLS)
        studio = Studio(folder, "balls.nii.gz")
        studio.until(lambda s: s["volume"] and s["job"] is None)
        studio.click(LEFT)
        studio.process.send_signal(signal.SIGINT)
        self.assertEqual(studio.process.wait(30), 130)
        studio.end()
        studio = Studio(folder)
        studio.do("quit")
        self.assertEqual(studio.process.wait(30), 0)
        studio.end()
        shutil.rmtree(folder)


if __name__ == "__main__":
    unittest.main(verbosity=2)
