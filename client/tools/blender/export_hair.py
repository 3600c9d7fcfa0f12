"""Writes the hair of a Blender scene as hairnet-groom imports it: strands, groups, the body under them, the head joint.

blender scene.blend --background --python export_hair.py -- --out FOLDER
In Blender's window it is an add-on: File > Export > Hairnet. For Blender 3.4 to 4.x; it needs nothing else.
"""
import argparse
import contextlib
import json
import os
import pathlib
import re
import shlex
import sys
import tempfile
import traceback
from array import array
from typing import Iterator, Optional

import bpy
from mathutils import Matrix, Vector

bl_info = {"name": "Hairnet", "author": "Hairnet", "version": (1, 0, 0), "blender": (3, 4, 0), "category": "Import-Export",
           "location": "File > Export > Hairnet", "description": "Hair, as strands for hairnet-groom"}

CATMULL_ROM, POLY, BEZIER, NURBS = range(4)  # Blender's types of curves
SHOULDERS = ("shoulder", "clavicle", "collar")
JOINTS = {"head": (("head",), ""), "neck": (("neck",), ""),
          "left_shoulder": (SHOULDERS, "l"), "right_shoulder": (SHOULDERS, "r")}
OTHER_BONES = {"end", "top", "tip", "nub", "ik", "pole", "target", "mch", "twist", "eye", "tweak"}


class ExportError(Exception):
    """One line that says why nothing was written."""


class HairSet:
    """The strands of one particle system, or of one hair-curves object and material, in metres, root first."""

    def __init__(self, owner: str, name: str, material: str, basis: str):
        self.owner, self.name, self.material, self.basis = owner, name, material, basis
        self.sizes, self.points = array("i"), array("f")

    def add(self, points: list) -> None:
        self.sizes.append(len(points))
        for point in points:
            self.points.extend(point)


@contextlib.contextmanager
def at_rest(context, children: str) -> Iterator["bpy.types.Depsgraph"]:
    """The scene at its first frame with armatures in their rest pose. Afterwards all is as it was."""
    scene, before = context.scene, []

    def put(owner, name: str, value) -> None:
        if getattr(owner, name) != value:  # setting a number of hairs lets Blender grow them again
            before.append((owner, name, getattr(owner, name)))
            setattr(owner, name, value)

    frame, subframe = scene.frame_current, scene.frame_subframe
    try:
        for obj in scene.objects:
            if obj.type == "ARMATURE":
                put(obj.data, "pose_position", "REST")
            for settings in [system.settings for system in obj.particle_systems if children == "rendered"]:
                put(settings, "child_percent" if hasattr(settings, "child_percent") else "child_nbr",  # 4.0, 3.4
                    settings.rendered_child_count)
                put(settings, "display_step", settings.render_step)
                put(settings, "display_percentage", 100)
        scene.frame_set(scene.frame_start)
        yield context.evaluated_depsgraph_get()
    finally:
        for owner, name, value in reversed(before):
            setattr(owner, name, value)
        scene.frame_set(frame, subframe=subframe)


def particle_set(obj, evaluated, system, children: str, scale: float) -> HairSet:
    """The paths of a system's hairs. Blender gives a point beyond the end of a path as (0, 0, 0)."""
    settings = system.settings
    slots = [slot.name for slot in obj.material_slots] or [""]
    hair = HairSet(obj.name, system.name, slots[min(settings.material, len(slots)) - 1], "linear")
    parents, with_children = len(system.particles), len(system.particles) + len(system.child_particles)
    shows_children = children != "none" and settings.child_type != "NONE" and with_children > parents
    first = parents if shows_children and not settings.use_parent_particles else 0
    steps = 2 ** settings.display_step + 1 + (settings.kink_extra_steps if settings.kink == "SPIRAL" else 0)
    for number in range(first, with_children if shows_children else parents):
        points = [system.co_hair(evaluated, particle_no=number, step=step) for step in range(steps)]
        while points and not any(points[-1]):
            points.pop()
        if len(points) > 1:
            hair.add([scale * point for point in points])
    if not hair.sizes:
        raise ExportError(f'particle system "{system.name}" of "{obj.name}" is empty: it shows no hair')
    return hair


def curve_sets(obj, owner: str, to_world: Matrix, notes: list) -> list:
    """The curves of a hair-curves object, by material and by the kind of curve."""
    data = obj.data

    def points_of(name: str) -> list:
        values = data.attributes[name].data if name in data.attributes else ()
        return [to_world @ one.vector for one in values]

    def of_curves(name: str) -> list:
        attribute = data.attributes.get(name)
        return [int(one.value) for one in attribute.data] if attribute else [0] * len(data.curves)

    types, slots, sets = of_curves("curve_type"), of_curves("material_index"), {}
    points, before, behind = points_of("position"), points_of("handle_left"), points_of("handle_right")
    names = [material.name if material else "" for material in data.materials] or [""]
    for curve, kind, slot in zip(data.curves, types, slots):
        begin, end = curve.first_point_index, curve.first_point_index + curve.points_length
        material = names[min(max(slot, 0), len(names) - 1)]
        if end - begin < 2:
            notes.append(f'curve {curve.index} of "{obj.name}" has no length, and is left out')
            continue
        controls, basis = points[begin:end], "linear"
        if kind == CATMULL_ROM:  # Blender repeats the outer points
            controls, basis = [controls[0], *controls, controls[-1]], "catmullRom"
        elif kind == BEZIER:
            controls, basis = [x for i in range(begin, end) for x in (before[i], points[i], behind[i])][1:-1], "bezier"
        name = f"{obj.name} {material}" if len(set(slots)) > 1 else obj.name
        sets.setdefault((name, basis), HairSet(owner, name, material, basis)).add(controls)
    if NURBS in types:
        notes.append(f'"{obj.name}": {types.count(NURBS)} NURBS curves are written as lines between their points')
    if closed := sum(of_curves("cyclic")):
        notes.append(f'"{obj.name}": {closed} closed curves are cut open where they begin')
    if not sets:
        raise ExportError(f'hair curves "{obj.name}" are empty: no curve has two points')
    return list(sets.values())


def particle_systems(obj) -> list:
    """The hair systems of an object, each with what keeps it from being shown."""
    found = []
    for modifier in [one for one in obj.modifiers if one.type == "PARTICLE_SYSTEM"]:
        system, shown_as = modifier.particle_system, modifier.particle_system.settings.render_type
        hidden = "" if modifier.show_viewport and obj.visible_get() else "is hidden"
        if not hidden and shown_as != "PATH":
            hidden = f"is rendered as {shown_as.lower()}, not as paths"
        if system.settings.type == "HAIR":
            found.append((system.name, hidden and f'particle system "{system.name}" of "{obj.name}" {hidden}'))
    return found


def find_hair(context, depsgraph, wanted: list, children: str, scale: float, notes: list) -> tuple:
    """All hair that is shown, or that of the wanted objects; and the objects that it grows on, None for no object."""
    sets, surfaces, found, hidden = [], [], set(), []
    for obj in context.view_layer.objects:
        for name, why in particle_systems(obj) if not wanted or obj.name in wanted else ():
            if why:
                hidden.append(why)
                continue
            evaluated = obj.evaluated_get(depsgraph)
            sets.append(particle_set(obj, evaluated, evaluated.particle_systems[name], children, scale))
            surfaces.append(obj)
            found.add(obj.name)
    for instance in depsgraph.object_instances:
        obj = instance.object
        if obj.type != "CURVES":
            continue
        surface = obj.data.surface or obj.parent or instance.parent
        surface = surface.original if surface and surface.type == "MESH" else None
        names = {obj.name, surface.name} if surface else {obj.name}
        if not wanted or names & set(wanted):
            to_world = Matrix.Scale(scale, 4) @ instance.matrix_world
            sets += curve_sets(obj, surface.name if surface else obj.name, to_world, notes)
            surfaces.append(surface)
            found |= names
    for name in [one for one in wanted if one not in found]:
        raise ExportError(f'object "{name}" has no hair that is shown')
    if not sets:
        nothing = "neither a particle system of hair nor hair curves (Object > Convert makes them of curves)"
        raise ExportError("the scene has no hair: " + ("; ".join(hidden) or nothing))
    notes += [line + ", and is left out" for line in hidden]
    return sets, surfaces


def name_groups(sets: list) -> dict:
    """A name for each owner and set: its own, with its owner's where others have the same."""
    identities = list(dict.fromkeys((one.owner, one.name) for one in sets))
    own = [name for _, name in identities]
    return {(owner, name): name if own.count(name) == 1 else f"{owner} {name}" for owner, name in identities}


def strands_text(sets: list, groups: dict) -> str:
    def quoted(text: str) -> str:
        return '"' + re.sub(r'(["\\])', r"\\\1", re.sub(r"[\x00-\x1f]", " ", text)) + '"'

    out = ['#usda 1.0\n(\n    defaultPrim = "hair"\n    metersPerUnit = 1\n    upAxis = "Z"\n)\n\ndef Xform "hair"\n{\n']
    for number, one in enumerate(sets):
        kind = "linear" if one.basis == "linear" else "cubic"
        out.append(f'    def BasisCurves "curves_{number}"\n    {{\n        uniform token type = "{kind}"\n')
        if kind == "cubic":
            out.append(f'        uniform token basis = "{one.basis}"\n        uniform token wrap = "nonperiodic"\n')
        out.append(f"        int[] curveVertexCounts = [{', '.join(map(str, one.sizes))}]\n")
        triples = ", ".join(["(%.6f, %.6f, %.6f)"] * (len(one.points) // 3)) % tuple(one.points)
        out.append(f"        point3f[] points = [{triples}]\n")
        group, material = quoted(groups[one.owner, one.name]), quoted(one.material)
        out.append(f'        string primvars:groom_group_name = {group} (interpolation = "constant")\n')
        out.append(f"        custom string userProperties:material = {material}\n    }}\n")
    return "".join(out) + "}\n"


def body_text(objects: list, depsgraph, scale: float) -> str:
    """The objects' triangles in world space and metres, as their modifiers make them."""
    out, first = [], 1
    for obj in objects:
        evaluated = obj.evaluated_get(depsgraph)
        mesh = evaluated.to_mesh()
        if mesh is None:
            raise ExportError(f'object "{obj.name}" has no mesh for a body')
        to_world = Matrix.Scale(scale, 4) @ evaluated.matrix_world
        mesh.calc_loop_triangles()
        out.append(f"o {re.sub(r'[^!-~]', '_', obj.name)}\n")
        out += ["v %.6f %.6f %.6f\n" % tuple(to_world @ vertex.co) for vertex in mesh.vertices]
        turn = -1 if to_world.determinant() < 0 else 1  # a mirrored mesh is wound inside out
        out += ["f %d %d %d\n" % tuple(first + v for v in list(one.vertices)[::turn]) for one in mesh.loop_triangles]
        first += len(mesh.vertices)
        evaluated.to_mesh_clear()
    return "".join(out)


def bone_of(armature, kinds: tuple, side: str) -> Optional[str]:
    """The bone whose name has one of these words, and few others: mixamorig:LeftShoulder, J_Bip_C_Head, clavicle_l."""
    found = []
    for bone in armature.data.bones:
        words = [w.lower() for w in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", bone.name.rpartition(":")[2])]
        sides = "".join(word[0] for word in words if word in ("l", "r", "left", "right"))
        if sides == side and set(kinds) & set(words) and not OTHER_BONES & set(words):
            found.append((len(words), not bone.use_deform, len(bone.name), bone.name))
    return min(found)[-1] if found else None


def find_bones(context, body: list, head: Optional[str], scale: float, notes: list) -> dict:
    """The joints of head, neck and shoulders at rest: {joint: (bone's name, position)}."""
    above = [obj.find_armature() or obj.parent for obj in body]
    armatures = [obj for obj in above if obj and obj.type == "ARMATURE"]
    armatures = list(dict.fromkeys(armatures or [obj for obj in context.view_layer.objects if obj.type == "ARMATURE"]))
    if head:
        armatures = [one for one in armatures if head in one.data.bones]
        if not armatures:
            raise ExportError(f'no armature has a bone "{head}"')
    if len(armatures) > 1:
        notes.append(f'the bones are those of "{armatures[0].name}", the first of {len(armatures)} armatures')
    bones = {}
    for joint, (kinds, side) in JOINTS.items() if armatures else ():
        name = head if head and joint == "head" else bone_of(armatures[0], kinds, side)
        if name:
            bones[joint] = name, scale * (armatures[0].matrix_world @ armatures[0].data.bones[name].head_local)
    return bones


def find_face(bones: dict, notes: list) -> str:
    """The axis that the face looks along, from the shoulders."""
    if "left_shoulder" not in bones or "right_shoulder" not in bones:
        notes.append("the face is taken to look along -y, as in Blender's front view; --face sets it")
        return "-y"
    face = (bones["left_shoulder"][1] - bones["right_shoulder"][1]).cross(Vector((0, 0, 1)))
    size, axis, sign = max((abs(x), axis, "+" if x > 0 else "-") for axis, x in zip("xy", face))
    if size < 0.94 * face.length:
        notes.append("the person is turned by more than 20 degrees from the axes, and so is the head after the import")
    return sign + axis


def write_all(folder: pathlib.Path, texts: dict) -> None:
    """All files or, when one cannot be written, none."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".export_hair-", dir=folder) as partial:
            for name, text in texts.items():
                pathlib.Path(partial, name).write_text(text, encoding="utf-8", newline="\n")
            for name in texts:
                os.replace(pathlib.Path(partial, name), folder / name)
    except OSError as error:
        raise ExportError(f"cannot write to {folder}: {error.strerror}") from error


def import_command(folder: pathlib.Path, face: str, is_rooted: bool, head, has_body: bool, groups: list) -> list:
    command = ["hairnet-groom", "import", str(folder / "hair.usda"), "--unit", "1", "--up", "+z", "--face", face]
    if is_rooted:
        command += ["--roots", "first"]
    if head:
        command.append("--origin=%.6f,%.6f,%.6f" % tuple(head[1]))
    if has_body:
        command += ["--body", str(folder / "body.obj"), "--body-unit", "1", "--body-up", "+z", "--body-face", face]
    if len(groups) == 1:
        command += ["--group", groups[0]]
    return command + ["--out", str(folder / (pathlib.Path(bpy.data.filepath).stem or "hair")) + ".groom"]


def export(context, out: str, wanted: list = (), children: str = "displayed", bodies: list = (),
           face: Optional[str] = None, head_bone: Optional[str] = None) -> list:
    """Writes the files. Returns lines for the user, the last of which is the command that imports them."""
    folder = pathlib.Path(bpy.path.abspath(out)).resolve()
    units, notes = context.scene.unit_settings, []
    scale = 1.0 if units.system == "NONE" else units.scale_length
    context.view_layer.update()
    for name in [one for one in (*wanted, *bodies) if one not in context.view_layer.objects]:
        raise ExportError(f'there is no object "{name}" in the view layer "{context.view_layer.name}"')
    with at_rest(context, children) as depsgraph:
        sets, surfaces = find_hair(context, depsgraph, wanted, children, scale, notes)
        body = [context.view_layer.objects[name] for name in bodies] or list(dict.fromkeys(filter(None, surfaces)))
        texts = {"body.obj": body_text(body, depsgraph, scale)} if body else {}
        bones = find_bones(context, body, head_bone, scale, notes)
    face = face or find_face(bones, notes)
    if "head" not in bones:
        notes.append("there is no bone of the head: the importer finds the head joint itself; --head-bone names one")
    names, groups = name_groups(sets), {}
    for one in sets:
        name = names[one.owner, one.name]
        group = groups.setdefault(name, {"name": name, "material": one.material, "strands": 0})
        group["strands"] += len(one.sizes)
    command = import_command(folder, face, None not in surfaces, bones.get("head"), bool(body), list(groups))
    facts = {"scene": bpy.data.filepath, "frame": context.scene.frame_start, "unit_m": 1, "up": "+z", "face": face,
             "strands": "hair.usda", "body": "body.obj" if body else None, "groups": list(groups.values()),
             "bones": {joint: {"bone": bone, "position_m": [round(x, 6) for x in position]}
                       for joint, (bone, position) in bones.items()},
             "notes": notes, "command": command, "command_line": shlex.join(command)}
    texts = {"hair.usda": strands_text(sets, names), **texts, "hairnet.json": json.dumps(facts, indent=2) + "\n"}
    write_all(folder, texts)
    lines = [f'group "{one["name"]}": {one["strands"]} strands, material "{one["material"]}"' for one in groups.values()]
    lines += [f'body: "{obj.name}"' for obj in body]
    lines += [f'{joint}: bone "{bone}" at {x:.4f},{y:.4f},{z:.4f} m' for joint, (bone, (x, y, z)) in bones.items()]
    return lines + ["note: " + note for note in notes] + [shlex.join(command)]


class HairnetExport(bpy.types.Operator):
    """Write the hair, the body under it and the head joint, as hairnet-groom imports them"""
    bl_idname = "export_scene.hairnet"
    bl_label = "Export Hair"
    directory: bpy.props.StringProperty(subtype="DIR_PATH")
    children: bpy.props.EnumProperty(name="Children of particles", items=[
        ("displayed", "Displayed", "As many as the viewport shows"), ("rendered", "Rendered", "As many as are rendered"),
        ("none", "None", "The parents alone")])

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT"

    def invoke(self, context, _event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        try:
            lines = export(context, self.directory, children=self.children)
        except ExportError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        print("\n".join(lines))
        context.window_manager.clipboard = lines[-1]
        self.report({"INFO"}, "Run this, it is in the clipboard: " + lines[-1])
        return {"FINISHED"}


def add_to_menu(self, _context):
    self.layout.operator(HairnetExport.bl_idname, text="Hairnet")


def register():
    bpy.utils.register_class(HairnetExport)
    bpy.types.TOPBAR_MT_file_export.append(add_to_menu)


def unregister():
    bpy.types.TOPBAR_MT_file_export.remove(add_to_menu)
    bpy.utils.unregister_class(HairnetExport)


def main(arguments: list) -> int:
    parser = argparse.ArgumentParser(prog="export_hair.py", description="Hair of a scene, for hairnet-groom import.")
    parser.add_argument("--out", required=True, metavar="FOLDER", help="for hair.usda, body.obj and hairnet.json")
    parser.add_argument("--object", action="append", default=[], metavar="NAME",
                        help="only the hair of this object, or on it; once for each (all that is shown)")
    parser.add_argument("--children", choices=("displayed", "rendered", "none"), default="displayed",
                        help="children of particles: as the viewport or the render has them, or the parents alone")
    parser.add_argument("--body", action="append", default=[], metavar="NAME",
                        help="the body; once for each object (what the hair grows on)")
    parser.add_argument("--face", choices=("+x", "-x", "+y", "-y"), help="where the face looks (found by the shoulders)")
    parser.add_argument("--head-bone", metavar="NAME", help="the head's bone (found by its usual names)")
    args = parser.parse_args(arguments)
    try:
        lines = export(bpy.context, os.path.abspath(args.out), args.object, args.children, args.body, args.face,
                       args.head_bone)
    except ExportError as error:
        print(f"export_hair: {error}", file=sys.stderr)
        return 1
    except Exception:  # Blender would print it, and exit with 0
        traceback.print_exc()
        return 1
    print("\n".join(lines), flush=True)
    return 0


if __name__ == "__main__":
    if bpy.app.background:
        sys.exit(main(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []))
    register()
