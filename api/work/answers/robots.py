"""Robots and their collision shapes in plain values; SI units."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.kinematics import frame_poses
from planner.robots import DRIVE_VALUES, RANGED_QUANTITIES, VelocityParabola, VelocityTable
from planner.robots.collision import MANY_POSITIONS, contacts, shapes_of_links
from planner.shapes import Box, Capsule, ConvexHull, Cylinder, Sphere
from planner.spatial import as_pose, quaternion

if TYPE_CHECKING:
    from planner.robots import Joint, PayloadTable, Robot
    from planner.robots.collision.geometry import LinkShape
    from planner.robots.collision.pairs import CollisionPair
    from planner.shapes import Shape
    from planner.spatial import FloatArray, Pose

JOINT_AXIS = [0.0, 0.0, 1.0]
"""The axis (3,) of each joint in its own frame: the library's models have all joints about, or along, z."""

DRAWN_CORNERS = 160
"""Largest number of corners of a drawn hull: round surfaces look round, and the six hulls of a link take 50 kB."""


def describe(robot: Robot) -> dict[str, Any]:
    """Return the robot as a dictionary of plain values; None where there is no limit. SI units."""
    mounting, model = robot.mounting, robot.model
    frames = [frame for frame in model.frames if frame.type.name != "FIXED_JOINT"]
    at_zero = frame_poses(robot, np.zeros(robot.dof))
    return {
        "id": robot.id,
        "source": robot.source,
        "notes": list(robot.notes),
        "dof": robot.dof,
        "joint_names": list(robot.joint_names),
        "joints": [_describe_joint(joint) for joint in robot.joints],
        "limit_sources": dict(robot.limit_sources),
        "tip_frame": robot.tip_frame,
        "chain": [placed(as_pose(placement)) | {"axis": JOINT_AXIS} for placement in list(model.jointPlacements)[1:]],
        "placements": [
            placed(as_pose(frame.placement))
            | {"frame": frame.name, "after": frame.parentJoint, "matrix_at_zero": _matrix(at_zero[frame.name])}
            for frame in frames
        ],
        "frames": [frame.name for frame in frames],
        "tool": placed(as_pose(robot.tool_in_tip)),
        "mounting": None if mounting is None else placed(mounting),
        "external_axes": list(robot.external_axes),
        **({"positioner": list(robot.positioner)} if robot.positioner else {}),
        "named_positions": {name: list(position) for name, position in robot.named_positions.items()},
        "mass": robot.mass,
        "rated_payload": robot.rated_payload,
        "rated_payload_source": robot.rated_payload_source,
        **({} if robot.payload_table is None else {"payload_table": _describe_table(robot.payload_table)}),
        "geometry": [dict(shape) for shape in robot.geometry],
        **({} if robot.visuals is None else {"has_visual_meshes": True}),
        "groups": [dict(vars(group)) for group in robot.groups],
        "disabled_collisions": [dict(vars(pair)) for pair in robot.disabled_collisions],
    }


def placed(pose: Pose) -> dict[str, list[float]]:
    """Return a pose as plain values; one without a rotation has the axes of its frame."""
    rotation = np.eye(3) if pose.rotation is None else pose.rotation
    return {"position": pose.position.tolist(), "quaternion_xyzw": quaternion(rotation).tolist()}


def _matrix(pose: Pose) -> list[list[float]]:
    """Return a pose with a rotation as a homogeneous matrix (4, 4), row by row."""
    rotation = np.asarray(pose.rotation)
    return [*np.column_stack([rotation, pose.position]).tolist(), [0.0, 0.0, 0.0, 1.0]]


def _describe_table(table: PayloadTable) -> dict[str, Any]:
    """Return a payload table, with the factors by speed where there are any."""
    by_speed = ("speeds", "acceleration_at_speeds", "jerk_at_speeds")
    return {name: value for name, value in asdict(table).items() if value or name not in by_speed}


def _describe_joint(joint: Joint) -> dict[str, Any]:
    limits = {
        name: value if math.isfinite(value := float(getattr(joint, name))) else None
        for name in ("lower", "upper", "velocity", "acceleration", "jerk", "torque")
    }
    ranges = {
        f"{quantity}_range": list(joint.ranges[quantity]) if quantity in joint.ranges else None
        for quantity in RANGED_QUANTITIES
    }
    described: dict[str, Any] = {
        "name": joint.name,
        "kind": joint.kind,
        **limits,
        **ranges,
        "provenance": dict(joint.provenance),
    }
    if joint.velocity_curves:
        described["velocity_curves"] = {
            side: list(map(_describe_curve, curves)) for side, curves in vars(joint.velocity_curves).items()
        }
    described |= {name: value for name in DRIVE_VALUES if (value := getattr(joint, name))}
    if math.isfinite(joint.rms_torque):
        described["rms_torque"] = joint.rms_torque
    if joint.torque_curve is not None:
        described["torque_curve"] = {name: list(values) for name, values in vars(joint.torque_curve).items()}
    return described


def describe_collision_geometry(robot: Robot) -> dict[str, Any]:
    """Return the shapes of a robot's links, and the pairs of links, as a dictionary of plain values; SI units.

    The function samples the contacts of each pair. A pair that is never in contact is checked nevertheless.
    """
    shapes, pairs = robot.collision_shapes, robot.collision_pairs
    of_link = shapes_of_links(shapes)
    checked = {pair: tuple(pair.checked_shapes(of_link)) for pair in pairs if pair.reason is None}
    shares = contacts(robot.model, (robot.limit("lower"), robot.limit("upper")), shapes, checked.values())
    return {
        "id": robot.id,
        "shapes": list(map(_describe_link_shape, shapes)),
        "pairs": [_describe_pair(pair, shares[checked[pair]] if pair in checked else None) for pair in pairs],
        "sampled_positions": MANY_POSITIONS,
        "findings": [asdict(finding) for finding in robot.collision_findings],
    }


def _describe_pair(pair: CollisionPair, contact_share: float | None) -> dict[str, Any]:
    always_touching = [list(both) for both in pair.always_touching]
    return asdict(pair) | {"always_touching": always_touching, "contact_share": contact_share}


def describe_drawn_links(robot: Robot) -> list[dict[str, Any]]:
    """Return the shapes of a robot's links for a picture, in plain values; SI units.

    Hulls have at most `DRAWN_CORNERS` corners: the outermost in as many directions, to within 10 µm.
    """
    return [_describe_link_shape(replace(each, shape=_drawn(each.shape))) for each in robot.collision_shapes]


def _drawn(shape: Shape) -> Shape:
    if not isinstance(shape, ConvexHull):
        return shape
    corners = shape.vertices
    if len(corners) > DRAWN_CORNERS:
        corners = corners[np.unique(np.argmax(_directions(DRAWN_CORNERS) @ corners.T, axis=1))]
    return ConvexHull(np.round(corners, 5))


def _directions(number: int) -> FloatArray:
    """Return unit vectors that are spread evenly, (number, 3): the lattice of Fibonacci on a sphere."""
    heights = 1.0 - (2.0 * np.arange(number) + 1.0) / number
    turns = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(number)
    widths = np.sqrt(1.0 - heights**2)
    return np.column_stack((widths * np.cos(turns), widths * np.sin(turns), heights))


def _describe_link_shape(each: LinkShape) -> dict[str, Any]:
    return {
        "link": each.link,
        "after": each.joint,
        **placed(as_pose(each.placement)),
        "source": each.source,
        "uncertainty": each.uncertainty,
        "shape": _describe_shape(each.shape),
    }


def _describe_shape(shape: Shape) -> dict[str, Any]:
    match shape:
        case Sphere(radius=radius):
            return {"kind": "sphere", "radius": radius}
        case Box(size=size):
            return {"kind": "box", "size": size.tolist()}
        case Cylinder(radius=radius, length=length):
            return {"kind": "cylinder", "radius": radius, "length": length}
        case Capsule(radius=radius, length=length):
            return {"kind": "capsule", "radius": radius, "length": length}
        case ConvexHull(vertices=vertices):
            return {"kind": "convex", "vertices": vertices.tolist(), "faces": shape.faces.tolist()}
    raise TypeError(f"no robot has a {type(shape).__name__}")


def _describe_curve(curve: VelocityParabola | VelocityTable) -> dict[str, Any]:
    kind = "parabola" if isinstance(curve, VelocityParabola) else "table"
    return {"kind": kind} | {name: list(v) if isinstance(v, tuple) else v for name, v in vars(curve).items()}
