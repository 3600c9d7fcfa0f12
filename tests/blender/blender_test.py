#!/usr/bin/env python3
"""Tests of client/tools/blender: a scene that Blender makes (make_scene.py), exported, imported, and compared point by point
with what Blender itself shows."""
import array
import json
import math
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXPORTER = ROOT / "client/tools/blender/export_hair.py"
NEAR_M = 0.0001


def run(*command, env=None):
    return subprocess.run([str(one) for one in command], capture_output=True, text=True, env=env, timeout=500)


def blender(*arguments):
    return run(os.environ["HAIRNET_BLENDER"], "--background", "--factory-startup", *arguments)


def first_row(path):
    """The triples in the first row of a .npy file of float32."""
    data = path.read_bytes()
    # A file of this format begins with ten bytes, and the last two of them give the length of the header that follows.
    begin = 10 + int.from_bytes(data[8:10], "little")
    shape = [int(one) for one in re.search(rb"'shape': \((.*?)\)", data[:begin])[1].split(b",") if one.strip()]
    values = array.array("f", data[begin:begin + 4 * math.prod(shape[1:])])
    return [tuple(values[i:i + 3]) for i in range(0, len(values), 3)]


class Near:
    """Finds out whether points are near lines, with a grid of the places beside them."""
    CELL_M = 0.004

    def __init__(self, lines):
        self.cells = {}
        for line in lines:
            for a, b in zip(line, line[1:]):
                steps = 1 + int(math.dist(a, b) / self.CELL_M)
                for cell in {self.cell([x + (y - x) * i / steps for x, y in zip(a, b)]) for i in range(steps + 1)}:
                    self.cells.setdefault(cell, []).append((a, b))

    def cell(self, point):
        return tuple(int(x // self.CELL_M) for x in point)

    def distance(self, point):
        # Only pieces in this cell and its neighbours are looked at. A point without any there counts as CELL_M away,
        # which is more than NEAR_M.
        i, j, k = self.cell(point)
        pieces = [piece for u in (-1, 0, 1) for v in (-1, 0, 1) for w in (-1, 0, 1)
                  for piece in self.cells.get((i + u, j + v, k + w), ())]
        return min((from_piece(point, *piece) for piece in pieces), default=self.CELL_M)


def from_piece(point, a, b):
    along = [y - x for x, y in zip(a, b)]
    length2 = sum(x * x for x in along)
    share = sum((p - x) * d for p, x, d in zip(point, a, along)) / length2 if length2 else 0
    share = min(max(share, 0), 1)
    return math.dist(point, [x + share * d for x, d in zip(a, along)])


class Blender(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = cls.enterClassContext(tempfile.TemporaryDirectory(prefix="hairnet-blender-"))
        cls.folder = pathlib.Path(os.environ.get("HAIRNET_KEEP", cls.folder))  # a folder to look into afterwards
        made = blender("--python-exit-code", "9", "--python", ROOT / "tests/blender/make_scene.py", "--", cls.folder, EXPORTER)
        assert made.returncode == 0, made.stdout + made.stderr
        cls.expected = json.loads((cls.folder / "expected.json").read_text())
        cls.out = cls.folder / "out put"  # the command must quote it
        cls.exported = run(os.environ["HAIRNET_BLENDER"], cls.folder / "scene.blend", "--background", "--python", EXPORTER,
                           "--", "--out", cls.out)
        assert cls.exported.returncode == 0, cls.exported.stdout + cls.exported.stderr
        cls.facts = json.loads((cls.out / "hairnet.json").read_text())
        cls.imported = cls.import_by(cls.facts["command_line"])

    @classmethod
    def import_by(cls, line):
        """Runs a printed command as a shell does."""
        path = f'{pathlib.Path(os.environ["HAIRNET_GROOM"]).parent}:{os.environ["PATH"]}'
        return run("sh", "-c", line, env={**os.environ, "PATH": path})

    def to_head(self, point):
        x, y, z = (a - b for a, b in zip(point, self.facts["bones"]["head"]["position_m"]))
        return (x, z, -y)

    def test_the_printed_command_imports_without_a_doubt(self):
        self.assertIn(self.facts["command_line"], self.exported.stdout.splitlines())
        self.assertEqual(shlex.split(self.facts["command_line"]), self.facts["command"])
        strict = self.import_by(self.facts["command_line"] + " --strict")
        self.assertEqual((self.imported.returncode, strict.returncode), (0, 0), self.imported.stderr + strict.stderr)
        self.assertRegex(self.imported.stdout, r"502 strands")

    def test_groups_have_names_materials_and_strands(self):
        self.assertEqual([(one["name"], one["material"], one["strands"]) for one in self.facts["groups"]],
                         [("Scalp", "Brown", 450), ("Fringe", "Red", 40), ("Locks Brown", "Brown", 6),
                          ("Locks Red", "Red", 6)])
        told = run(os.environ["HAIRNET_GROOM"], "inspect", self.out / "scene.groom").stdout
        groups = re.findall(r"^group +(.*?) +(\d+) strands, (\d+) with roots on the skull", told, re.MULTILINE)
        self.assertEqual(groups[:2], [("Scalp", "450", "450"), ("Fringe", "40", "40")], told)
        self.assertEqual([group[:2] for group in groups[2:]], [("Locks Brown", "6"), ("Locks Red", "6")], told)

    def test_joints_and_face_are_those_of_the_armature_at_rest(self):
        places = {joint: bone["position_m"] for joint, bone in self.facts["bones"].items()}
        self.assertEqual(places, {"head": [0, 0, 1.5], "neck": [0, 0.01, 1.42], "left_shoulder": [0.04, 0.01, 1.38],
                                  "right_shoulder": [-0.04, 0.01, 1.38]})
        self.assertEqual(self.facts["bones"]["head"]["bone"], "mixamorig:Head")
        self.assertEqual((self.facts["up"], self.facts["face"], self.facts["frame"]), ("+z", "-y", 1))

    def test_the_body_is_the_head_at_rest_in_metres(self):
        lines = [line.split() for line in (self.out / "body.obj").read_text().splitlines()]
        vertices = [tuple(map(float, line[1:])) for line in lines if line[0] == "v"]
        # The sphere of make_scene.py has 48 segments and 32 rings, so 31 rings of vertices and two poles. Its centre is
        # 159 cm above the floor and its top 11 cm higher.
        self.assertEqual(len(vertices), 48 * 31 + 2)
        centre = [(min(axis) + max(axis)) / 2 for axis in zip(*vertices)]
        for found, expected in zip(centre, (0, 0, 1.59)):
            self.assertAlmostEqual(found, expected, places=4)
        self.assertAlmostEqual(max(v[2] for v in vertices), 1.70, places=4)
        self.assertEqual(sum(line[0] == "f" for line in lines), 48 * 31 * 2)

    def test_points_are_where_blender_has_them(self):
        points = self.folder / "points.npy"
        run(os.environ["HAIRNET_SIM"], "--groom", self.out / "scene.groom", "--motion", "made:still", "--level", "ether",
            "--points", points, "--poses", self.folder / "poses.npy")
        lift = first_row(self.folder / "poses.npy")[0]
        imported = [tuple(a - b for a, b in zip(point, lift)) for point in first_row(points)]
        strands = [[self.to_head(x) for x in strand] for group in self.expected["hairs"].values() for strand in group]
        # The groom has the strands in this order, root first. Where curves are sampled by both, their ends alone are alike.
        # Particle hairs and straight locks have fewer than 20 points, which both programs have alike. The eight curved
        # locks have more.
        exact = [strand for strand in strands if len(strand) < 20]
        self.assertEqual(len(exact), 450 + 40 + 4)
        particles = [x for strand in strands[:490] for x in strand]
        locks = imported[len(particles):]
        self.assertLess(max(map(math.dist, particles, imported)), NEAR_M)
        for strand in strands[490:]:
            for end in (strand[0], strand[-1]):
                self.assertLess(min(math.dist(end, x) for x in locks), NEAR_M)
        blenders, ours = Near(strands[490:]), Near([locks])
        self.assertLess(max(blenders.distance(x) for x in locks), NEAR_M)
        self.assertLess(max(ours.distance(x) for strand in strands[490:] for x in strand), NEAR_M)

    def test_the_menu_exports_children_as_rendered_and_leaves_the_scene_as_it_was(self):
        facts = json.loads((self.folder / "rendered/hairnet.json").read_text())
        # Each of the 150 hairs of the scalp is drawn as 3 children in the viewport and as 7 in a rendered image.
        self.assertEqual([one["strands"] for one in facts["groups"]], [7 * 150, 40, 6, 6])
        # The state after the export: the frame, whether the armature is posed, the children in the viewport, and the
        # display step.
        self.assertEqual(self.expected["state"], [20, "POSE", 3, 4])
        self.assertEqual(self.import_by(facts["command_line"]).returncode, 0)

    def test_bad_input_is_one_line_and_writes_nothing(self):
        # The lines are in the order of the calls in refusals() of make_scene.py.
        said = ["there is no object \"Nobody\"", "object \"Lamp\" has no hair", "there is no object \"Nobody\"",
                "no armature has a bone \"Nobody\"", "cannot write to", "particle system \"None\" of \"Bald\" is empty",
                "particle system \"None\" of \"Bald\" is empty", "\"Scalp\" of \"Head\" is hidden", "the scene has no hair"]
        self.assertEqual(len(self.expected["refusals"]), len(said))
        for (status, line, was_written), expected in zip(self.expected["refusals"], said):
            self.assertEqual((status, line.count("\n"), was_written), (1, 1, False), line)
            self.assertIn(expected, line)

    def test_the_process_fails_with_its_line(self):
        refused = blender("--python", EXPORTER, "--", "--out", self.folder / "nothing")
        self.assertEqual((refused.returncode, (self.folder / "nothing").exists()), (1, False))
        self.assertIn("export_hair: the scene has no hair", refused.stderr)
        self.assertEqual(blender("--python", EXPORTER, "--").returncode, 2)

    def test_exports_parents_alone_and_single_objects(self):
        parents, locks = (json.loads((self.folder / name / "hairnet.json").read_text()) for name in ("parents", "locks"))
        self.assertEqual([(one["name"], one["strands"]) for one in parents["groups"]],
                         [("Scalp", 150), ("Fringe", 40), ("Locks Brown", 6), ("Locks Red", 6)])
        self.assertEqual([(one["name"], one["strands"]) for one in locks["groups"]], [("Locks Brown", 6), ("Locks Red", 6)])
        self.assertEqual(locks["face"], "+y")


if __name__ == "__main__":
    if sys.version_info < (3, 11):
        sys.exit("blender_test.py needs Python 3.11")
    unittest.main()
