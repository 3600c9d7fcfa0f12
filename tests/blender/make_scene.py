"""Runs in Blender: makes a head with hair, and writes the scene, where Blender itself has each hair, and how export_hair.py
refuses. Everything is in centimetres, scaled, turned, and away from its rest when it is saved.

blender --background --factory-startup --python make_scene.py -- FOLDER EXPORT_HAIR
"""
import contextlib
import importlib.util
import io
import json
import math
import pathlib
import sys

import bpy
from mathutils import Matrix, Vector

FOLDER, EXPORTER = (pathlib.Path(one) for one in sys.argv[sys.argv.index("--") + 1:])
CM = 0.01


def add(name, data):
    obj = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(obj)
    return obj


def choose(obj):
    bpy.ops.object.select_all(action="DESELECT")
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj


def add_armature():
    rig = add("Rig", bpy.data.armatures.new("Rig"))
    rig.location = (0, 1, 0)
    choose(rig)
    bpy.ops.object.mode_set(mode="EDIT")
    parent = None
    for name, head, tail in (("mixamorig:Neck", (0, 0, 142), (0, -1, 150)), ("mixamorig:Head", (0, -1, 150), (0, -1, 170)),
                             ("mixamorig:HeadTop_End", (0, -1, 170), (0, -1, 175)),
                             ("mixamorig:LeftShoulder", (4, 0, 138), (15, 0, 138)),
                             ("mixamorig:RightShoulder", (-4, 0, 138), (-15, 0, 138))):
        bone = rig.data.edit_bones.new(name)
        bone.head, bone.tail = head, tail
        bone.parent = parent if "Head" in name else None
        parent = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    nod = rig.pose.bones["mixamorig:Head"]
    nod.rotation_mode = "XYZ"
    nod.rotation_euler = (0.5, 0.2, 0.3)
    # The armature is at its place in frame 1, and 30 cm beside it in frame 20, in which the scene is saved.
    rig.keyframe_insert("location", frame=1)
    rig.location = (30, 0, 0)
    rig.keyframe_insert("location", frame=20)
    return rig


def add_head(rig, materials):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=32, radius=1)
    head = bpy.context.object
    head.name = "Head"
    head.scale = (4, 5, 5.5)
    bpy.ops.object.transform_apply(scale=True)  # else a nod shears the head, and Blender grows other hair on it
    head.location, head.scale, head.rotation_euler = (0, -1, 159), (2, 2, 2), (0, 0, 0.3)
    for material in materials:
        head.data.materials.append(material)
    everything, scalp = head.vertex_groups.new(name="mixamorig:Head"), head.vertex_groups.new(name="scalp")
    everything.add(range(len(head.data.vertices)), 1, "REPLACE")
    # Hair grows on the upper part of the head alone.
    scalp.add([v.index for v in head.data.vertices if v.co.z > 0.8], 1, "REPLACE")
    head.parent = rig
    head.modifiers.new("Armature", "ARMATURE").object = rig
    for name, count, length, slot in (("Scalp", 150, 3, 1), ("Fringe", 40, 2, 2)):
        head.modifiers.new(name, "PARTICLE_SYSTEM")
        system = head.particle_systems[-1]
        system.name, system.vertex_group_density = name, "scalp"
        settings = system.settings
        settings.type, settings.count, settings.hair_length, settings.material = "HAIR", count, length, slot
        settings.display_step, settings.length_random = 4, 0.5
    settings = head.particle_systems["Scalp"].settings
    settings.child_type, settings.child_nbr, settings.rendered_child_count = "INTERPOLATED", 3, 7
    settings.roughness_1, settings.child_length, settings.child_length_threshold = 0.3, 0.6, 0.5
    return head


def add_locks(rig, head, materials):
    """Hair curves: 4 of Catmull-Rom, 4 lines, 4 of Bezier; of both materials."""
    curve = bpy.data.curves.new("Locks", "CURVE")
    curve.dimensions = "3D"
    for number in range(12):
        spline = curve.splines.new("BEZIER" if number >= 8 else "POLY")
        points = spline.bezier_points if number >= 8 else spline.points
        points.add(7)
        angle = number * math.tau / 12
        for i, point in enumerate(points):
            x = Vector((4 * math.cos(angle) + 0.4 * math.cos(i), 5 * math.sin(angle) + 0.4 * math.sin(i), 12 + i))
            point.co = x if number >= 8 else (*x, 1)
            if number >= 8:
                point.handle_left_type = point.handle_right_type = "AUTO"
    locks = add("Locks", curve)
    choose(locks)
    bpy.ops.object.convert(target="CURVES")
    locks = bpy.context.object
    locks.name = "Locks"
    for material in materials:
        locks.data.materials.append(material)
    for number in range(4):
        # The value 0 makes a Catmull-Rom curve of a line.
        locks.data.attributes["curve_type"].data[number].value = 0
    slots = locks.data.attributes.new("material_index", "INT", "CURVE")
    for number in range(12):
        slots.data[number].value = number % 2
    locks.data.surface = head
    locks.location, locks.rotation_euler, locks.scale = (0, -1, 159), (0.1, 0, 0), (1, 1, 0.9)
    locks.parent, locks.parent_type, locks.parent_bone = rig, "BONE", "mixamorig:Head"
    bone = rig.data.bones["mixamorig:Head"]  # what it carries is placed at its tail
    tail = bone.matrix_local @ Matrix.Translation((0, bone.length, 0))
    locks.matrix_parent_inverse = (rig.matrix_world @ tail).inverted()
    return locks


def polylines(mesh, to_world):
    """The chains of a mesh whose edges follow each other."""
    lines = []
    for edge in sorted(tuple(sorted(edge.vertices)) for edge in mesh.edges):
        if not lines or lines[-1][-1] != edge[0]:
            lines.append([edge[0]])
        lines[-1].append(edge[1])
    return [[list(CM * (to_world @ mesh.vertices[v].co)) for v in line] for line in lines]


def mesh_of_curves(locks):
    """The curves as Blender draws them, by geometry nodes."""
    nodes = bpy.data.node_groups.new("Lines", "GeometryNodeTree")
    if hasattr(nodes, "interface"):  # since 4.0
        nodes.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    else:
        nodes.outputs.new("NodeSocketGeometry", "Geometry")
    source, wire, out = (nodes.nodes.new(kind) for kind in (
        "GeometryNodeObjectInfo", "GeometryNodeCurveToMesh", "NodeGroupOutput"))
    source.transform_space, source.inputs["Object"].default_value = "RELATIVE", locks
    nodes.links.new(source.outputs["Geometry"], wire.inputs["Curve"])
    nodes.links.new(wire.outputs["Mesh"], out.inputs[0])
    obj = add("Lines", bpy.data.meshes.new("Lines"))
    obj.modifiers.new("Lines", "NODES").node_group = nodes
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return bpy.data.meshes.new_from_object(evaluated), evaluated.matrix_world


def hairs_of_blender(rig, head, locks):
    """Where hair is at rest, by the operators that make meshes of it."""
    rig.data.pose_position = "REST"
    bpy.context.scene.frame_set(1)
    found = {}
    for name in ("Scalp", "Fringe"):
        choose(head)
        bpy.ops.object.modifier_convert(modifier=name)
        found[name] = polylines(bpy.context.object.data, bpy.context.object.matrix_world)
        bpy.data.objects.remove(bpy.context.object)
    lines = polylines(*mesh_of_curves(locks))
    found["Locks Brown"], found["Locks Red"] = lines[0::2], lines[1::2]
    return found


def refusals(exporter):
    """[exit status, what is said, whether something was written] of each bad call."""
    said = []

    def call(*flags, out="refused"):
        with contextlib.redirect_stderr(io.StringIO()) as errors:
            status = exporter.main(["--out", str(FOLDER / out), *flags])
        said.append([status, errors.getvalue(), (FOLDER / "refused").exists()])

    call("--object", "Nobody")
    call("--object", "Lamp")
    call("--body", "Nobody")
    call("--head-bone", "Nobody")
    call(out="scene.blend/below")
    bald = add("Bald", bpy.data.meshes["Sphere"].copy())
    bald.modifiers.new("None", "PARTICLE_SYSTEM")
    bald.particle_systems[0].settings.type, bald.particle_systems[0].settings.count = "HAIR", 0
    call("--object", "Bald")
    call()
    for obj in list(bpy.data.objects):
        obj.hide_viewport = obj.hide_viewport or obj.name != "Lamp"
    call()
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    call()
    return said


def main():
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.context.scene.unit_settings.scale_length = CM
    materials = [bpy.data.materials.new(name) for name in ("Brown", "Red")]
    rig = add_armature()
    bpy.context.scene.frame_set(1)
    head = add_head(rig, materials)
    locks = add_locks(rig, head, materials)
    add("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    bpy.context.scene.frame_set(20)
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "scene.blend"))

    spec = importlib.util.spec_from_file_location("export_hair", EXPORTER)
    exporter = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(exporter)
    exporter.register()
    bpy.ops.export_scene.hairnet(directory=str(FOLDER / "rendered"), children="rendered")
    exporter.unregister()
    settings = head.particle_systems["Scalp"].settings
    state = [bpy.context.scene.frame_current, rig.data.pose_position, settings.child_nbr, settings.display_step]
    assert exporter.main(["--out", str(FOLDER / "parents"), "--object", "Head", "--children", "none"]) == 0
    assert exporter.main(["--out", str(FOLDER / "locks"), "--object", "Locks", "--face", "+y", "--body", "Locks"]) == 1
    assert exporter.main(["--out", str(FOLDER / "locks"), "--object", "Locks", "--face", "+y"]) == 0
    hairs = hairs_of_blender(rig, head, locks)
    (FOLDER / "expected.json").write_text(json.dumps({"hairs": hairs, "state": state, "refusals": refusals(exporter)}))


main()
