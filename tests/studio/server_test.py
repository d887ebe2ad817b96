#!/usr/bin/python3
"""surfseg studio's server: what it does, and whom it refuses. No browser."""
import http.client
import json
import math
import os
import random
import shutil
import socket
import subprocess
import threading
import time
import unittest

from studio import BALLS, LEFT, RIGHT, Studio, can_mount, content, folder_with, mounted, phantom, write_dicom

# The finer a surface, the longer it evolves: to be tried one after the other until what passes by meanwhile has been met,
# since a machine may be so fast or so busy that nobody looks in time.
FINER = [{"edge_length_mm": edge_length, "coarseness": 1} for edge_length in (0.03, 0.02, 0.015, 0.0125, 0.01)]


def replay(folder, recipe, *words):
    subprocess.run([os.environ["SURFSEG_PROGRAM"], "replay", recipe, *words], cwd=folder, check=True,
                   capture_output=True)


def run(folder, command):
    """The line as a shell takes it."""
    subprocess.run(command, shell=True, check=True, cwd=folder, capture_output=True,
                   env={**os.environ, "PATH": os.path.dirname(os.environ["SURFSEG_PROGRAM"]) + ":" + os.environ["PATH"]})


class WithStudio(unittest.TestCase):
    phantoms = [BALLS]
    words = ["balls.nii.gz"]

    def make_folder(self):
        self.folder = folder_with(*self.phantoms)

    def setUp(self):
        self.make_folder()
        self.studio = Studio(self.folder, *self.words)
        if self.words and self.words[0] != ".":
            self.studio.until(lambda s: s["volume"] and s["job"] is None)

    def tearDown(self):
        self.studio.end()
        shutil.rmtree(self.folder)


class SeveralSeries(WithStudio):
    phantoms, words = [], ["."]

    def make_folder(self):
        super().make_folder()
        folder = os.path.join(self.folder, "patient")
        os.mkdir(folder)
        for series in ("1.2.3.4", "1.2.3.5"):
            for k in range(24):
                write_dicom(os.path.join(folder, f"{series}-{k}.dcm"), series, k)

    def test_a_folder_of_several_series_offers_a_choice(self):
        entry = self.studio.state()["files"][0]
        self.assertEqual((entry["path"], entry["kind"], "series" in entry), ("patient", "DICOM folder", False))
        self.studio.do("open", path="patient")
        state = self.studio.until(lambda s: s["error"] is not None and s["job"] is None)
        self.assertIn("holds 2 series", state["error"]["text"])
        self.assertEqual([s["id"] for s in state["files"][0]["series"]], ["1.2.3.4", "1.2.3.5"])
        self.assertEqual(state["files"][0]["series"][1]["words"], "MR series 5, 24 files")
        self.studio.do("open", path="patient", series="1.2.3.5")
        state = self.studio.until(lambda s: s["volume"] is not None and s["job"] is None)
        self.assertEqual(state["volume"]["size"], [32, 32, 24])
        self.studio.click((-15, -15, 12))
        ml = self.studio.idle()["objects"][0]["measures"]["volume_ml"]
        self.assertAlmostEqual(ml, 4 / 3 * math.pi, delta=0.15)
        first = state["volume"]["revision"]
        self.which_one_is_in_command_line_and_recipe()
        # Each series has its own state.
        self.studio.do("open", path="patient", series="1.2.3.4")
        state = self.studio.until(lambda s: s["volume"] and s["volume"]["revision"] == first + 1 and s["job"] is None)
        self.assertEqual(state["objects"][0]["clicks"], [])
        self.studio.do("open", path="patient", series="1.2.3.5")
        state = self.studio.until(lambda s: s["volume"] and s["volume"]["revision"] == first + 2 and s["job"] is None)
        self.assertEqual(state["objects"][0]["measures"]["volume_ml"], ml)


    def which_one_is_in_command_line_and_recipe(self):
        self.studio.export(what="surface", object=1, name="ours.stl")
        command = json.loads(self.studio.get("/api/command?object=1"))["text"]
        self.assertIn(" --series-uid '1.2.3.5' ", command)
        run(self.folder, command)
        self.assertEqual(content(self.folder, "object 1.stl"), content(self.folder, "ours.stl"))
        self.studio.export(what="recipe", name="ours.json")
        self.assertEqual(json.loads(content(self.folder, "ours.json"))["image"]["series_uid"], "1.2.3.5")
        replay(self.folder, "ours.json", "-o", "again.stl")
        self.assertEqual(content(self.folder, "again.stl"), content(self.folder, "ours.stl"))
        opened = self.studio.state()["volume"]
        self.assertEqual((opened["kept_in"], opened["notes"]), ("patient.1.2.3.5.surfseg.json", ["series 'series 5'"]))

    def test_a_recipe_opens_its_series(self):
        self.studio.do("open", path="patient", series="1.2.3.5")
        first = self.studio.until(lambda s: s["volume"] and s["job"] is None)["volume"]["revision"]
        self.studio.click((-15, -15, 12))
        clicks = self.studio.idle()["objects"][0]["clicks"]
        self.studio.export(what="recipe", name="ours.json")
        for n, name in enumerate(("patient.1.2.3.5.surfseg.json", "ours.json")):
            self.studio.do("open", path=name)
            state = self.studio.until(lambda s: s["volume"] and s["volume"]["revision"] == first + n + 1 and s["job"] is None)
            self.assertEqual((state["objects"][0]["clicks"], state["volume"]["kept_in"]), (clicks, name))


class OddSeries(WithStudio):
    phantoms, words = [], ["."]
    SERIES = "1/../../surfseg-elsewhere"

    def make_folder(self):
        self.top = folder_with()
        self.addCleanup(shutil.rmtree, self.top, ignore_errors=True)
        self.folder = os.path.join(self.top, "scans")
        for name in ("patient", "patient.1"):
            os.makedirs(os.path.join(self.folder, name))
        for n, series in enumerate((self.SERIES, "1.2.3.5")):
            for k in range(24):
                write_dicom(os.path.join(self.folder, "patient", f"{n}-{k}.dcm"), series, k)

    def test_a_series_whose_uid_is_a_path_is_kept_in_the_folder(self):
        self.studio.do("open", path="patient", series=self.SERIES)
        state = self.studio.until(lambda s: (s["volume"] or s["error"]) and s["job"] is None)
        self.assertEqual(state["volume"]["kept_in"], "patient.1_.._.._surfseg-elsewhere.surfseg.json")
        self.studio.click((-15, -15, 12))
        self.assertIsNone(self.studio.idle()["error"])
        self.assertEqual(os.listdir(self.top), ["scans"])
        self.assertIn(state["volume"]["kept_in"], os.listdir(self.folder))


class Dialogue(WithStudio):
    def test_clicks_make_and_mend_a_surface_that_is_exported(self):
        self.studio.click(LEFT)
        one = self.studio.idle()["objects"][0]
        self.assertEqual(one["outcome"], "converged")
        self.assertTrue(one["measures"]["passed"])
        self.studio.click(RIGHT)
        two = self.studio.idle()["objects"][0]
        self.assertAlmostEqual(two["measures"]["volume_ml"] / one["measures"]["volume_ml"], 2, delta=0.05)
        self.studio.click((0, 0, 0), "outside")
        self.assertEqual(len(self.studio.idle()["objects"][0]["clicks"]), 3)
        for what, name in (("surface", "balls.stl"), ("surface", "balls.vtp"), ("labels", "labels.nii.gz"),
                           ("recipe", "balls.json"), ("measures", "balls.csv"), ("picture", "balls.png")):
            self.assertEqual(self.studio.export(what=what, object=1, name=name)["bytes"],
                             os.path.getsize(os.path.join(self.folder, name)))
        replay(self.folder, "balls.json", "-o", "again.stl", "--mask", "again.nii.gz")
        replay(self.folder, "balls.json", "-o", "again.vtp")
        self.assertEqual(content(self.folder, "balls.stl"), content(self.folder, "again.stl"))
        self.assertEqual(content(self.folder, "balls.vtp"), content(self.folder, "again.vtp"))
        self.assertEqual(content(self.folder, "labels.nii.gz"), content(self.folder, "again.nii.gz"))
        self.assertEqual(len(content(self.folder, "balls.csv").splitlines()), 2)
        command = json.loads(self.studio.get("/api/command?object=1"))["text"]
        run(self.folder, command)
        self.assertEqual(content(self.folder, "object 1.stl"), content(self.folder, "balls.stl"))

    def test_undo_takes_back_one_act_with_what_it_set_off(self):
        self.studio.click(LEFT)
        one = self.studio.idle()["objects"][0]
        self.studio.click(RIGHT)
        two = self.studio.idle()["objects"][0]
        self.assertEqual(two["undo_words"], "inside click")
        self.studio.do("undo", object=1)
        undone = self.studio.idle()["objects"][0]
        self.assertEqual(undone["measures"], one["measures"])
        self.assertEqual(undone["clicks"], one["clicks"])
        self.assertTrue(undone["can_redo"])
        self.studio.do("redo", object=1)
        self.assertEqual(self.studio.idle()["objects"][0]["measures"], two["measures"])
        self.studio.do("move_click", object=1, index=1, point=[0.5, 0.1, 0])
        moved = self.studio.idle()["objects"][0]
        self.assertEqual([c["point"] for c in moved["clicks"]], [list(LEFT), [0.5, 0.1, 0]])
        self.assertEqual(moved["undo_words"], "moved click")
        self.studio.do("undo", object=1)
        back = self.studio.state()["objects"][0]
        self.assertEqual((back["clicks"], back["redo_words"]), (two["clicks"], "moved click"))
        self.studio.do("redo", object=1)
        self.assertEqual(self.studio.state()["objects"][0]["clicks"], moved["clicks"])
        self.studio.do("delete_click", object=1, index=1)
        self.assertEqual(len(self.studio.idle()["objects"][0]["clicks"]), 1)
        for _ in range(10):
            self.studio.do("undo", object=1)
        empty = self.studio.state()["objects"][0]
        self.assertEqual((empty["clicks"], empty["can_undo"], empty["has_surface"]), ([], False, False))

    def test_a_click_that_is_another_one_by_now_is_left_alone(self):
        self.studio.click(LEFT)
        self.studio.click(RIGHT)
        before = self.studio.idle()["objects"][0]["clicks"]
        for action, more in (("move_click", {"point": [0.5, 0.1, 0]}), ("delete_click", {})):
            for index, was in ((0, RIGHT), (1, LEFT), (2, RIGHT)):
                said = self.studio.do(action, 409, object=1, index=index, was=list(was), **more)
                self.assertIn("not where it was", said["error"])
                self.assertNotIn("exists", said)
        self.assertEqual(self.studio.idle()["objects"][0]["clicks"], before)
        self.studio.do("move_click", 400, object=1, index=0, was=[1, 2], point=[0.5, 0.1, 0])
        self.studio.do("move_click", object=1, index=0, was=list(LEFT), point=[-0.5, 0.1, 0])
        self.studio.do("delete_click", 409, object=1, index=0, was=list(LEFT))  # it is the second one now
        self.studio.do("delete_click", object=1, index=0, was=list(RIGHT))
        self.assertEqual([c["point"] for c in self.studio.idle()["objects"][0]["clicks"]], [[-0.5, 0.1, 0]])

    def test_undo_brings_back_what_was_removed(self):
        self.studio.do("rename", object=1, name="left")
        self.studio.do("recolour", object=1, colour="#00ff80")
        self.studio.click(LEFT)
        self.studio.idle()
        self.studio.do("set_options", object=1, options={"fill_cavities": True})
        left = self.studio.idle()["objects"][0]
        surface = self.studio.get("/api/surface?object=1")
        kept = content(self.folder, "balls.nii.gz.surfseg.json")
        self.studio.do("remove_object", object=1)
        state = self.studio.idle()
        self.assertEqual((state["objects"], state["removed"]), ([], "left"))
        self.studio.do("undo")  # without an object: none is left
        state = self.studio.idle()
        again = state["objects"][0]
        self.assertIsNone(state["removed"])
        for what in ("id", "name", "colour", "clicks", "options", "measures", "outcome", "verdict", "undo_words"):
            self.assertEqual(again[what], left[what], what)
        self.assertEqual(self.studio.get("/api/surface?object=1"), surface)
        self.assertEqual(content(self.folder, "balls.nii.gz.surfseg.json"), kept)
        self.assertEqual(again["redo_words"], "removal of left")
        self.studio.do("redo", object=1)
        self.assertEqual(self.studio.idle()["objects"], [])
        self.studio.do("undo")
        self.studio.idle()
        self.studio.do("undo", object=1)
        undone = self.studio.idle()["objects"][0]
        self.assertEqual((undone["options"], undone["redo_words"]), ({}, "options"), "its own past is there, too")
        self.studio.do("redo", object=1)
        self.assertEqual(self.studio.idle()["objects"][0]["redo_words"], "removal of left")
        self.studio.do("recolour", object=1, colour="#00ff00")
        self.assertFalse(self.studio.idle()["objects"][0]["can_redo"], "something else was done since")
        self.studio.do("undo", object=1)
        self.studio.do("undo", object=1)
        for _ in range(9):
            self.studio.do("undo", object=1)
        self.studio.do("undo", 400)

    def test_undo_to_a_name_that_another_has_changes_nothing(self):
        self.studio.click(LEFT)
        self.studio.idle()
        self.studio.do("rename", object=1, name="left")
        self.studio.do("evolve", object=1)
        self.studio.idle()
        self.studio.do("add_object", name="object 1")
        before = self.studio.idle()["objects"][0]
        said = self.studio.do("undo", 400, object=1)
        self.assertIn("there is an object 'object 1' already", json.dumps(said))
        after = self.studio.idle()["objects"][0]
        for what in ("name", "has_surface", "outcome", "undo_words", "can_redo"):
            self.assertEqual(after[what], before[what], what)

    @unittest.skipIf("SURFSEG_SANITIZED" in os.environ, "the memory is the sanitizer's")
    def test_two_hundred_clicks_leave_the_memory_as_it_was(self):
        draw = random.Random(1)
        self.studio.click(LEFT)
        self.studio.idle()
        for n in range(200):
            x, y, z = (draw.uniform(-0.9, 0.9) for _ in range(3))
            depth = math.hypot(x + 0.5, y, z) - 0.3  # of the left ball, negative inside
            self.studio.click((x, y, z), "inside" if depth < -0.05 else "outside", expect=None)
            self.studio.idle()
            if n % 4 == 3:
                self.studio.do("undo", object=1)
                self.studio.idle()
            if n == 19:
                before = self.studio.memory_mb()
        self.assertLess(self.studio.memory_mb(), 1.1 * before)

    def test_undo_takes_back_acts_and_removals_in_their_order(self):
        self.studio.click(LEFT)
        self.studio.idle()
        self.studio.do("add_object", name="right")
        self.studio.do("add_object", name="third")
        self.studio.do("remove_object", object=1)
        self.studio.click(RIGHT, object=2)
        self.studio.do("remove_object", object=3)
        right = self.studio.idle()["objects"][0]
        self.assertEqual((right["can_undo"], right["undo_words"]), (True, "removal of third"))
        names = []
        for _ in range(3):
            self.studio.do("undo", object=2)
            state = self.studio.idle()
            names.append([o["name"] for o in state["objects"]])
            right = next(o for o in state["objects"] if o["id"] == 2)
            names[-1].append(len(right["clicks"]))
        self.assertEqual(names, [["right", "third", 1], ["right", "third", 0], ["object 1", "right", "third", 0]])
        self.assertFalse(right["can_undo"])
        self.studio.do("remove_object", object=3)
        self.studio.do("rename", object=2, name="third")
        self.assertIn("there is an object 'third' already", self.studio.do("undo", 400)["error"])
        self.studio.do("undo", object=2)  # the name
        self.studio.do("undo", object=2)
        self.assertEqual([o["name"] for o in self.studio.state()["objects"]], ["object 1", "right", "third"])

    def until_it_evolves(self):
        """Or has done so, before anybody looked."""
        return self.studio.until(lambda s: s["job"]["stage"] if s["job"] else s["objects"][0]["has_surface"])

    def test_a_removal_while_it_evolves_is_undone(self):
        self.studio.do("set_options", object=1, options=FINER[0])
        self.studio.click(LEFT)
        self.until_it_evolves()
        self.studio.do("remove_object", object=1)
        self.assertEqual(self.studio.until(lambda s: s["job"] is None)["objects"], [])
        self.studio.do("undo")
        again = self.studio.idle()["objects"][0]
        self.assertEqual((len(again["clicks"]), again["outcome"]), (1, "converged"))

    def click_both_before_one_evolution(self, finer=FINER):
        for options in finer:
            for _ in range(3):  # to the beginning
                self.studio.do("undo", object=1)
            self.studio.do("set_options", object=1, options=options)
            self.studio.click(LEFT)
            self.until_it_evolves()
            self.studio.click(RIGHT)
            both = self.studio.idle()["objects"][0]
            self.assertEqual(len(both["clicks"]), 2)
            self.studio.export(what="recipe", name="both.json", overwrite=True)
            history = json.loads(content(self.folder, "both.json"))["objects"][0]["history"]
            self.assertFalse(any("stopped_at" in a for a in history), "no trace of what was superseded")
            done = [a["do"] for a in history]
            if done != ["options", "click", "evolve", "click", "evolve"]:
                break
        self.assertEqual(done, ["options", "click", "click", "evolve"])

    def test_a_newer_click_supersedes_what_is_computed(self):
        self.click_both_before_one_evolution()

    def test_stop_keeps_the_surface_so_far(self):
        self.studio.click(LEFT)
        for options in FINER:
            self.studio.do("set_options", object=1, options=options)
            self.studio.until(lambda s: s["job"] is None or s["job"]["stage"] == "evolve")  # not "propose"
            self.studio.do("stop")
            stopped = self.studio.until(lambda s: s["job"] is None)["objects"][0]
            if stopped["outcome"] != "converged":
                break
        self.assertEqual((stopped["outcome"], stopped["has_surface"]), ("interrupted", True))
        self.studio.do("evolve", object=1)
        self.assertEqual(self.studio.idle()["objects"][0]["outcome"], "converged")

    def test_the_state_tells_how_far_the_job_is(self):
        jobs = []

        def is_done(state):
            if state["job"]:
                jobs.append((state["job"]["id"], state["job"]["frame"]))
            return state["job"] is None and state["objects"][0]["has_surface"]

        self.studio.click(LEFT)
        for options in FINER:
            self.studio.do("set_options", object=1, options=options)  # it evolves anew
            self.studio.until(is_done)
            if any(frame > 0 for _, frame in jobs):
                break
        self.assertGreater(max((frame for _, frame in jobs), default=0), 0)
        self.assertEqual(jobs, sorted(jobs), "a job goes on, never back")

    def test_options_presets_and_proposals(self):
        self.studio.click(LEFT)
        fine = self.studio.idle()["objects"][0]
        self.studio.do("set_options", object=1, options={"edge_length_mm": 0.2, "fill_cavities": True})
        coarse = self.studio.idle()["objects"][0]
        self.assertLess(coarse["measures"]["triangles"], fine["measures"]["triangles"])
        self.assertEqual(coarse["options"], {"edge_length_mm": 0.2, "fill_cavities": True})
        self.studio.do("set_options", object=1, options={"edge_length_mm": None})
        self.assertEqual(self.studio.idle()["objects"][0]["options"], {"fill_cavities": True})
        several = {"coarseness": 2.0, "topology": "fixed", "keep": "largest", "max_steps": 9, "fill_cavities": True,
                   "energies": ["minimal-surface:lambda=2"]}
        self.studio.do("set_options", object=1, options=several)
        self.assertEqual(self.studio.state()["objects"][0]["options"].keys(), several.keys())
        self.studio.do("set_options", object=1, options=dict.fromkeys(several))
        self.assertEqual(self.studio.idle()["objects"][0]["options"], {})
        for options in ({"no": 1}, {"edge_length_mm": "2"}, {"coarseness": 0}, {"topology": "odd"},
                        {"energies": ["no-such"]}):
            answer = self.studio.do("set_options", 400, object=1, options=options)
            self.assertNotIn("\n", answer["error"])
        self.studio.do("choose", object=1, number=1)
        self.studio.idle()
        self.studio.do("choose", 400, object=1, number=99)
        self.assertIn("no candidate 99", self.studio.do("choose", 400, object=1, number=99)["error"])
        self.studio.do("choose", 400, object=1, number=0)
        for index in (-1, 0.5, "0", 1e30):
            self.studio.do("delete_click", 400, object=1, index=index)
        self.studio.do("preset", object=1, name="kidney-ct")
        self.studio.do("preset", 400, object=1, name="no-such")
        described = json.loads(self.studio.get("/api/options"))
        self.assertIn("minimal-surface", [e["name"] for e in described["energies"]])

    def test_objects_do_not_overlap(self):
        self.studio.do("rename", object=1, name="left")
        self.studio.click(LEFT)
        self.studio.do("add_object", name="right")
        self.studio.do("recolour", object=2, colour="#00ff80")
        self.studio.click(RIGHT, object=2)
        state = self.studio.idle()
        self.assertEqual([(o["name"], len(o["clicks"])) for o in state["objects"]], [("left", 1), ("right", 1)])
        self.assertEqual(state["objects"][1]["colour"], "#00ff80")
        self.studio.do("rename", 400, object=2, name="left")
        self.studio.do("recolour", 400, object=2, colour="green")
        self.studio.export(what="labels", name="both.nii.gz")
        self.studio.export(what="surface", object=2, name="right.stl")
        self.studio.do("remove_object", object=1)
        self.assertEqual([o["name"] for o in self.studio.state()["objects"]], ["right"])

    def test_a_name_and_a_colour_end_no_evolution(self):
        self.studio.do("set_options", object=1, options=FINER[0])
        self.studio.click(LEFT)
        job = self.until_it_evolves()["job"]
        self.studio.do("rename", object=1, name="left")
        self.studio.do("recolour", object=1, colour="#00ff80")
        during = self.studio.state()
        self.assertEqual((during["objects"][0]["name"], during["objects"][0]["colour"]), ("left", "#00ff80"))
        self.studio.do("rename", 400, object=1, name="")
        self.studio.do("rename", 400, object=7, name="x")
        jobs = set()

        def is_done(state):
            if state["job"]:
                jobs.add(state["job"]["id"])
            return state["job"] is None and state["objects"][0]["has_surface"] and state["objects"][0]["name"] == "left"

        self.studio.until(is_done)
        self.assertLessEqual(jobs, {job["id"]} if job else set(), "no other evolution was begun")
        self.studio.do("undo", object=1)  # the colour
        self.studio.do("undo", object=1)  # the name
        undone = self.studio.idle()["objects"][0]
        self.assertEqual((undone["name"], undone["has_surface"]), ("object 1", True))

    def volume_ml(self):
        return self.studio.idle()["objects"][0]["measures"]["volume_ml"]

    def test_what_undo_comes_back_to_is_computed_if_it_never_was(self):
        self.studio.click(LEFT)
        one = self.volume_ml()
        self.studio.click(RIGHT)
        self.studio.click((0.4, 0.1, 0.1))  # before the click on the right was heeded
        self.assertAlmostEqual(self.volume_ml() / one, 2, delta=0.05)
        self.studio.do("undo", object=1)
        undone = self.studio.idle()["objects"][0]
        self.assertEqual((len(undone["clicks"]), undone["outdated"]), (2, False))
        self.assertAlmostEqual(undone["measures"]["volume_ml"] / one, 2, delta=0.05)
        self.assertEqual(undone["redo_words"], "inside click")
        self.studio.do("redo", object=1)
        redone = self.studio.idle()["objects"][0]
        self.assertEqual((len(redone["clicks"]), redone["outdated"], redone["can_redo"]), (3, False, False))

    def test_states_that_cannot_be_evolved_end_no_studio(self):
        self.studio.click(LEFT)
        self.studio.idle()
        self.studio.do("add_object")
        self.studio.do("remove_object", object=1)
        self.studio.click(LEFT, object=2)
        self.studio.idle()
        self.studio.do("undo", object=0)  # both have the click now
        self.studio.do("set_options", None, object=1, options={"edge_length_mm": 0.1})
        state = self.studio.until(lambda s: s["job"] is None and s["error"])
        self.assertIn("inside click", state["error"]["text"])
        self.assertEqual(len(state["objects"]), 2)

    def test_a_name_that_another_has_by_now_is_not_redone(self):
        self.studio.click(LEFT)
        self.studio.idle()
        self.studio.click(RIGHT)
        self.studio.do("rename", object=1, name="x")
        self.studio.idle()
        self.studio.do("undo", object=1)
        self.studio.do("undo", object=1)
        self.studio.do("add_object", name="x")
        self.studio.do("redo", object=1)
        redone = self.studio.idle()["objects"][0]
        self.assertEqual((redone["name"], len(redone["clicks"]), redone["outdated"]), ("object 1", 2, False))
        self.studio.do("undo", object=4294967297, expect=400)

    def test_a_click_that_may_not_be_moved_there_leaves_what_can_be_redone(self):
        self.studio.click(LEFT)
        self.studio.click((0, 0, 0), "outside")
        self.studio.idle()
        self.studio.click(RIGHT)
        self.studio.idle()
        self.studio.do("undo", object=1)
        before = self.studio.idle()["objects"][0]
        self.assertEqual(before["redo_words"], "inside click")
        for point in ((50, 0, 0), (0, 0, 0)):  # beyond the scan, and on a click of the other side
            self.studio.do("move_click", 400, object=1, index=0, point=list(point))
            self.assertEqual(self.studio.idle()["objects"][0], before)
        self.studio.do("redo", object=1)
        self.assertEqual(len(self.studio.idle()["objects"][0]["clicks"]), 3)

    def test_what_redo_comes_to_is_computed_if_it_never_was(self):
        self.studio.click(LEFT)
        one = self.volume_ml()
        self.studio.click(RIGHT)
        self.studio.do("undo", object=1)  # before it was heeded
        self.assertAlmostEqual(self.volume_ml() / one, 1, delta=0.01)
        self.studio.do("redo", object=1)
        redone = self.studio.idle()["objects"][0]
        self.assertEqual((len(redone["clicks"]), redone["outdated"]), (2, False))
        self.assertAlmostEqual(redone["measures"]["volume_ml"] / one, 2, delta=0.05)

    def test_acts_before_one_evolution_are_redone_together(self):
        for n in range(len(FINER)):
            self.click_both_before_one_evolution(FINER[n:])
            two = self.volume_ml()
            self.studio.do("undo", object=1)  # the one that is left begins to evolve
            self.studio.do("undo", object=1)
            self.assertEqual(self.studio.idle()["objects"][0]["clicks"], [])
            self.studio.do("redo", object=1)
            redone = self.studio.idle()["objects"][0]
            if len(redone["clicks"]) == 2:
                break
        self.assertEqual(len(redone["clicks"]), 2)
        self.assertEqual(redone["measures"]["volume_ml"], two)

    def test_a_redo_of_nothing_ends_no_evolution(self):
        for _ in range(5):
            self.studio.click(LEFT)
            self.studio.do("redo", object=1)
            self.assertEqual(self.studio.idle()["objects"][0]["outcome"], "converged")
            self.studio.do("delete_click", object=1, index=0)

    def test_a_surface_that_does_not_heed_what_was_done_says_so(self):
        self.studio.click(LEFT)
        self.assertFalse(self.studio.idle()["objects"][0]["outdated"])
        self.studio.do("delete_click", object=1, index=0)
        left = self.studio.idle()["objects"][0]
        self.assertEqual((left["has_surface"], left["outdated"], left["verdict"]), (True, True, None))
        self.studio.click((-0.45, 0, 0))
        self.assertFalse(self.studio.idle()["objects"][0]["outdated"])

    def test_two_studios_on_one_scan_lose_nothing(self):
        self.studio.click(LEFT)
        self.studio.idle()
        with Studio(self.folder, "balls.nii.gz") as other:
            other.idle()
            other.click(RIGHT)
            two = other.idle()
            self.assertIsNone(two["error"])
            theirs = content(self.folder, "balls.nii.gz.surfseg.json")
            self.studio.click((0, 0.9, 0), "outside")
            state = self.studio.idle()
            self.assertIn("is now balls.nii.gz.surfseg.json.1", state["error"]["text"])
            self.assertEqual(content(self.folder, "balls.nii.gz.surfseg.json.1"), theirs)
            self.studio.click((0, -0.9, 0), "outside")
            self.assertEqual(self.studio.idle()["error"]["id"], state["error"]["id"])

    def test_a_name_given_before_an_evolution_begins_is_undone_alone(self):
        for _ in range(8):
            self.studio.do("add_object")
            number = self.studio.state()["objects"][-1]["id"]
            self.studio.click(LEFT, object=number)
            self.studio.do("rename", object=number, name="left")
            named = self.studio.idle()["objects"][-1]
            self.assertEqual((named["name"], named["undo_words"]), ("left", "name"))
            self.studio.do("undo", object=number)
            undone = self.studio.idle()["objects"][-1]
            self.assertEqual((undone["has_surface"], undone["undo_words"]), (True, "inside click"))
            self.studio.do("remove_object", object=number)

    def test_a_name_given_while_an_object_evolves_is_kept_at_the_end(self):
        self.studio.click(LEFT)
        self.studio.do("rename", object=1, name="left")
        self.studio.process.terminate()
        self.studio.process.wait(20)
        self.assertIn(b'"left"', content(self.folder, "balls.nii.gz.surfseg.json"))

    def test_a_report_is_that_of_the_command_line(self):
        self.studio.click(LEFT)
        self.studio.idle()
        self.studio.do("add_object", name="it's right")
        self.studio.click(RIGHT, object=2)
        self.studio.idle()
        self.studio.export(400, what="report", object=1, name="report.pdf")
        for number, name in ((2, "one.html"), (0, "all.html")):
            self.studio.export(what="report", object=number, name=name)
            ours = content(self.folder, name)
            command = json.loads(self.studio.get(f"/api/command?object={number}"))["text"]
            os.remove(os.path.join(self.folder, name))
            run(self.folder, f"{command} --report {name}")

            def without_command(page):
                return [line for line in page.splitlines() if b"surfseg replay" not in line]

            self.assertEqual(without_command(ours), without_command(content(self.folder, name)), name)
            self.assertIn(b"surfseg replay", ours)

    def test_measures_are_of_the_object_that_is_wanted(self):
        self.studio.click(LEFT)
        self.studio.idle()
        self.studio.do("add_object", name="right")
        self.studio.click(RIGHT, object=2)
        self.studio.idle()
        self.studio.export(what="measures", name="both.csv")
        head, *both = content(self.folder, "both.csv").splitlines()
        self.assertEqual([row.split(b",")[1] for row in both], [b'"object 1"', b'"right"'])
        self.studio.export(what="measures", object=2, name="right.csv")
        self.assertEqual(content(self.folder, "right.csv").splitlines(), [head, both[1]])
        self.studio.export(400, what="measures", object=7, name="none.csv")
        self.assertEqual(self.studio.export(what="recipe", object=2)["file"], "balls.json")  # it is of all

    def test_surfaces_are_bytes(self):
        self.studio.click(LEFT)
        measures = self.studio.idle()["objects"][0]["measures"]
        body = self.studio.get("/api/surface?object=1")
        vertices, triangles, arrays, frame = (int.from_bytes(body[4 * k:4 * k + 4], "little") for k in range(4))
        self.assertEqual((vertices, triangles), (measures["vertices"], measures["triangles"]))
        self.assertEqual((arrays, frame), (2, 0))
        self.assertEqual(len(body), 16 + 12 * vertices + 12 * triangles + 8 * vertices)
        self.assertGreater(len(self.studio.get("/api/candidate?object=1&number=1")), 1000)
        for path in ("/api/surface?object=9", "/api/candidate?object=1&number=99"):
            self.assertEqual(self.studio.request("GET", path)[0], 404)
        self.assertEqual(self.studio.request("GET", "/api/surface?object=x")[0], 400)


class Refusals(WithStudio):
    def make_folder(self):
        self.top = folder_with()
        self.addCleanup(shutil.rmtree, self.top, ignore_errors=True)
        self.folder = os.path.join(self.top, "scans")
        os.mkdir(self.folder)
        phantom(self.folder, *BALLS)

    def test_clicks_that_cannot_be(self):
        self.studio.click((50, 0, 0), expect=400)
        self.studio.click(LEFT)
        self.studio.click(LEFT, "outside", expect=400)
        self.studio.click(LEFT, object=7, expect=400)
        for body in ({}, {"action": "fly"}, {"action": "click"}, {"action": "click", "object": "1", "point": LEFT, "side": "inside"},
                     {"action": "click", "object": 1, "point": [0, 0], "side": "inside"},
                     {"action": "click", "object": 1, "point": [0, 0, 0], "side": "both"},
                     {"action": "delete_click", "object": 1, "index": 99}, {"action": "open", "path": "../balls.nii.gz"},
                     {"action": "open", "path": "/etc/passwd"}):
            status, answer, _ = self.studio.request("POST", "/api/do", body)
            self.assertEqual(status, 400, body)
            self.assertNotIn("\n", json.loads(answer)["error"])
        self.assertEqual(self.studio.request("POST", "/api/do", "no JSON", {"Content-Type": "application/json"})[0], 400)
        self.assertEqual(self.studio.request("POST", "/api/do", "{}", {"Content-Type": "text/plain"})[0], 415)

    def test_names_of_files(self):
        self.studio.click(LEFT)
        self.studio.idle()
        for name in ("../a.stl", os.path.join(self.top, "a.stl"), "a/b.stl", "..", ".hidden.stl", "a.exe", "a\nb.stl",
                     "a\\b.stl", "x" * 300 + ".stl"):
            self.assertIn("error", self.studio.export(400, what="surface", object=1, name=name))
        os.symlink("../elsewhere.stl", os.path.join(self.folder, "link.stl"))
        self.studio.export(400, what="surface", object=1, name="link.stl", overwrite=True)
        os.symlink("../elsewhere.mtl", os.path.join(self.folder, "beside.mtl"))
        for overwrite in (False, True):
            self.studio.export(400, what="surface", object=1, name="beside.obj", overwrite=overwrite)
        self.assertEqual(os.listdir(self.top), ["scans"])
        self.studio.export(what="surface", object=1, name="a.stl")
        before = content(self.folder, "a.stl")
        self.assertTrue(self.studio.export(409, what="surface", object=1, name="a.stl", space="ras")["exists"])
        self.assertEqual(content(self.folder, "a.stl"), before)
        self.studio.export(what="surface", object=1, name="a.stl", space="ras", overwrite=True)
        self.assertNotEqual(content(self.folder, "a.stl"), before)
        self.studio.export(400, what="labels", name="balls.nii.gz", overwrite=True)
        self.studio.export(400, what="surface", object=9, name="b.stl")
        self.studio.export(400, what="secrets", name="b.txt")

    @unittest.skipIf(os.geteuid() == 0 and not os.path.exists("/dev/full"), "root writes everywhere")
    def test_an_export_that_fails_leaves_nothing(self):
        self.studio.click(LEFT)
        self.studio.idle()
        if os.geteuid() != 0:
            os.chmod(self.folder, 0o500)
            self.addCleanup(os.chmod, self.folder, 0o700)
            self.assertIn("error", self.studio.export(500, what="surface", object=1, name="b.stl"))
        os.mkdir(os.path.join(self.folder, "folder.stl")) if os.geteuid() == 0 else None
        if os.geteuid() == 0:
            self.assertIn("error", self.studio.export(400, what="surface", object=1, name="folder.stl"))


class VoxelsOfAHeader(WithStudio):
    phantoms, words = [], ["v.mhd"]

    def make_folder(self):
        super().make_folder()
        with open(os.path.join(self.folder, "v.mhd"), "w") as header:
            header.write("ObjectType = Image\nNDims = 3\nDimSize = 16 16 16\nElementType = MET_UCHAR\n"
                         "ElementDataFile = voxels.json\n")
        with open(os.path.join(self.folder, "voxels.json"), "wb") as voxels:
            voxels.write(bytes(k // 32 for k in range(16**3)))

    def test_they_are_not_written_over(self):
        before = content(self.folder, "voxels.json")
        said = self.studio.export(400, what="recipe", name="voxels.json", overwrite=True)["error"]
        self.assertEqual(said, "'voxels.json' is the volume that is open, or a part of it")
        self.assertEqual(content(self.folder, "voxels.json"), before)
        self.studio.export(what="recipe", name="other.json")


@unittest.skipUnless(can_mount(), "skipped: no mounts of one's own here")
class LittleRoom(unittest.TestCase):
    def setUp(self):
        self.source, self.folder = folder_with(BALLS), folder_with()
        self.addCleanup(shutil.rmtree, self.source)
        self.addCleanup(shutil.rmtree, self.folder)

    def begin(self, room):
        studio = Studio(self.folder, "balls.nii.gz", before=mounted(self.source, room))
        studio.until(lambda s: s["volume"] and s["job"] is None)
        studio.click(LEFT)
        return studio, studio.idle()

    def test_a_full_disk_is_told_and_nothing_is_left(self):
        studio, state = self.begin(room=5 * 4096)  # for the recipe twice, as it is written whole; not for a surface
        self.assertIsNone(state["error"])
        for what, name in (("surface", "a.stl"), ("picture", "a.png"), ("report", "a.html")):
            before = studio.listed()
            answer = studio.export(500, what=what, object=1, name=name)
            self.assertIn("No space left on device", answer["error"])
            self.assertIn(name, answer["error"])
            self.assertNotIn("\n", answer["error"])
            self.assertEqual(studio.listed(), before)
        kept = json.loads(studio.get("/api/command?object=1"))
        # Full to the last page: the state of this moment is not kept, the one before stays whole.
        n = 0
        while studio.request("POST", "/api/export", {"what": "measures", "name": f"{n}.csv"})[0] == 200:
            n += 1
        self.assertGreater(n, 0)
        studio.click(RIGHT)
        state = studio.until(lambda s: s["error"] and s["job"] is None and s["objects"][0]["has_surface"])
        self.assertIn("the state is not kept", state["error"]["text"])
        self.assertEqual(len(state["objects"][0]["clicks"]), 2)
        with open(f"/proc/{studio.process.pid}/cwd/balls.nii.gz.surfseg.json") as file:
            self.assertEqual(json.load(file)["kind"], "surfseg recipe")
        self.assertEqual(json.loads(studio.get("/api/command?object=1")), kept)
        said = studio.end()
        self.assertIn("a.stl", said)
        self.assertIn("the state is not kept", said)

    def test_a_read_only_folder_is_told_and_looked_at(self):
        studio, state = self.begin(room=None)
        self.assertIn("the state is not kept", state["error"]["text"])
        self.assertIn("Read-only", state["error"]["text"])
        self.assertTrue(state["objects"][0]["measures"]["passed"])
        self.assertIn("Read-only", studio.export(500, what="surface", object=1, name="a.stl")["error"])
        self.assertEqual(studio.listed(), ["balls.nii.gz"])
        self.assertIn("Read-only", studio.end())


    def test_a_broken_state_in_a_read_only_folder_is_told_and_the_scan_is_looked_at(self):
        kept = "balls.nii.gz.surfseg.json"
        with open(os.path.join(self.source, kept), "w") as file:
            file.write("{ no JSON")
        with Studio(self.folder, "balls.nii.gz", before=mounted(self.source)) as studio:
            opened = studio.until(lambda s: s["volume"] and s["job"] is None)
            for words in ("JSON", f"{kept} stays as it is", "Read-only", "make the folder writable"):
                self.assertIn(words, opened["error"]["text"])
            self.assertEqual(len(opened["objects"]), 1)
            self.assertIn("Read-only", studio.export(500, what="recipe", name="a.json")["error"])
            studio.click(LEFT)
            state = studio.idle()
            self.assertTrue(state["objects"][0]["measures"]["passed"])
            self.assertIn("the state is not kept", state["error"]["text"])
            self.assertEqual(studio.listed(), ["balls.nii.gz", kept])


class Access(WithStudio):
    def test_who_has_no_token(self):
        for path in ("/", "/studio.js", "/api/state", "/api/events", "/api/volume.nii.gz"):
            self.assertEqual(self.studio.request("GET", path, token=False)[0], 401, path)
        wrong = {"Authorization": "Bearer " + "0" * 32}
        self.assertEqual(self.studio.request("GET", "/api/state", headers=wrong)[0], 401)
        self.assertEqual(self.studio.request("GET", "/?token=" + "0" * 32, token=False)[0], 401)
        self.assertEqual(self.studio.request("POST", "/api/do", {"action": "quit"}, token=False)[0], 401)

    def test_the_token_becomes_a_cookie(self):
        status, _, headers = self.studio.request("GET", "/?token=" + self.studio.token, token=False)
        self.assertEqual((status, headers["Location"]), (302, "/"))
        for word in ("HttpOnly", "SameSite=Strict", f"surfseg-{self.studio.port}="):
            self.assertIn(word, headers["Set-Cookie"])
        cookie = {"Cookie": headers["Set-Cookie"].split(";")[0]}
        status, body, headers = self.studio.request("GET", "/", headers=cookie, token=False)
        self.assertEqual((status, headers["Content-Encoding"]), (200, "gzip"))
        self.assertIn("default-src 'none'", headers["Content-Security-Policy"])
        self.assertEqual(headers["X-Content-Type-Options"], "nosniff")

    def test_other_hosts_and_pages(self):
        for headers, status in (({"Host": "evil.example"}, 421), ({"Host": f"127.0.0.1:{self.studio.port + 1}"}, 421),
                                ({"Origin": "http://evil.example"}, 403), ({"Origin": "null"}, 403),
                                ({"Origin": f"http://127.0.0.1:{self.studio.port}"}, 200),
                                ({"Sec-Fetch-Site": "cross-site"}, 403), ({"Sec-Fetch-Site": "same-site"}, 403),
                                ({"Sec-Fetch-Site": "same-origin"}, 200)):
            self.assertEqual(self.studio.request("GET", "/api/state", headers=headers)[0], status, headers)

    def test_paths_lead_nowhere_else(self):
        for path in ("/../etc/passwd", "/%2e%2e/etc/passwd", "/..%2f..%2fetc/passwd", "/api/../../etc/passwd", "/balls.nii.gz",
                     "/api/volume.nii.gz/../../x"):
            status, body, _ = self.studio.request("GET", path)
            self.assertIn(status, (400, 404), path)
            self.assertNotIn(b"root:", body)

    def test_ranges_beyond_the_end_give_nothing_of_the_memory(self):
        whole = self.studio.get("/api/volume.nii.gz")
        for first, last in ((len(whole), len(whole) + 999), (len(whole) - 10, len(whole) + 999), (10**9, 10**9 + 999)):
            try:
                body = self.studio.request("GET", "/api/volume.nii.gz", headers={"Range": f"bytes={first}-{last}"})[1]
            except (http.client.HTTPException, OSError):
                continue  # the answer was cut off
            self.assertIn(body, (b"", whole[first:], whole))

    def test_large_bodies_and_halves(self):
        with socket.create_connection(("127.0.0.1", self.studio.port)) as client:
            client.sendall((f"POST /api/do HTTP/1.1\r\nHost: 127.0.0.1:{self.studio.port}\r\nAuthorization: Bearer {self.studio.token}\r\n"
                            "Content-Type: application/json\r\nContent-Length: 1000000000\r\n\r\n{").encode())
            client.settimeout(30)
            self.assertIn(b"413", client.recv(100).split(b"\r\n")[0])
        half = socket.create_connection(("127.0.0.1", self.studio.port))
        half.sendall(b"POST /api/do HTTP/1.1\r\nHost: 127")
        self.assertEqual(self.studio.state()["volume"]["path"], "balls.nii.gz")
        half.close()

    def test_what_no_route_answers_says_so_in_one_line(self):
        for method, path, body, status in (("GET", "/nothing", None, 404), ("GET", "/api/do", None, 404), ("POST", "/api/state", {}, 404),
                                           ("GET", "/" + "a" * 9000, None, 414), ("POST", "/api/do", " " * ((1 << 20) + 1), 413)):
            answer = self.studio.request(method, path, body)
            self.assertEqual((answer[0], answer[2]["Content-Type"]), (status, "application/json"), path[:20])
            self.assertRegex(json.loads(answer[1])["error"], r"^[a-z][^\n]+$")
        # What a route says stays.
        self.assertIn("object 9 has no surface", json.loads(self.studio.request("GET", "/api/surface?object=9")[1])["error"])

    def test_many_streams_do_not_block_it(self):
        streams = []
        for _ in range(100):
            connection = http.client.HTTPConnection("127.0.0.1", self.studio.port, timeout=30)
            connection.request("GET", "/api/events", headers={"Authorization": f"Bearer {self.studio.token}"})
            streams.append(connection)
        started = time.time()
        self.studio.click(LEFT)
        self.studio.idle()
        self.assertLess(time.time() - started, 60)
        for connection in streams:
            connection.close()

    def test_two_tabs_see_the_same_and_one_may_go(self):
        def listen(events):
            connection = http.client.HTTPConnection("127.0.0.1", self.studio.port, timeout=60)
            connection.request("GET", "/api/events", headers={"Authorization": f"Bearer {self.studio.token}"})
            answer = connection.getresponse()
            for line in answer:
                if line.startswith(b"data: "):
                    events.append(json.loads(line[6:]))
                if events and "objects" in events[-1] and events[-1]["objects"][0]["has_surface"] and not events[-1]["job"]:
                    return connection.close()

        for options in FINER:
            self.studio.do("set_options", object=1, options=options)
            first, second = [], []
            threads = [threading.Thread(target=listen, args=(events,)) for events in (first, second)]
            for thread in threads:
                thread.start()
            gone = http.client.HTTPConnection("127.0.0.1", self.studio.port)
            gone.request("GET", "/api/events", headers={"Authorization": f"Bearer {self.studio.token}"})
            self.studio.until(lambda s: first and second)
            self.studio.click(LEFT)
            gone.close()
            for thread in threads:
                thread.join(60)
                self.assertFalse(thread.is_alive())
            self.assertEqual(first[-1]["objects"], second[-1]["objects"])
            if any("stage" in event for event in first):
                break
            self.studio.do("undo", object=1)
        self.assertTrue(any("stage" in event for event in first), "progress is told")


if __name__ == "__main__":
    unittest.main(verbosity=2)
