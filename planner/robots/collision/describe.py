"""What of a robot can collide in plain words and numbers."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from planner.robots.collision.pairs import MANY_POSITIONS, contacts
from planner.shapes import Box, Capsule, ConvexHull, Cylinder, Sphere
from planner.spatial import quaternion

if TYPE_CHECKING:
    from planner.robots.robot import Robot
    from planner.shapes import Shape


def describe_collision_geometry(robot: Robot) -> dict[str, Any]:
    """Return the shapes of a robot's links, and the pairs of links, as a dictionary of plain values; SI units.

    How often the links of a pair are in contact is sampled here: a pair that never is, is checked all the same.
    """
    shapes, pairs = robot.collision_shapes, robot.collision_pairs
    checked = [(pair.link_1, pair.link_2) for pair in pairs if pair.reason is None]
    shares = contacts(robot.model, (robot.limit("lower"), robot.limit("upper")), shapes, checked)
    return {
        "id": robot.id,
        "shapes": [
            {
                "link": each.link,
                "after": each.joint,
                "position": each.placement.translation.tolist(),
                "quaternion_xyzw": quaternion(each.placement.rotation).tolist(),
                "source": each.source,
                "shape": _describe_shape(each.shape),
            }
            for each in shapes
        ],
        "pairs": [asdict(pair) | {"contact_share": shares.get((pair.link_1, pair.link_2))} for pair in pairs],
        "sampled_positions": MANY_POSITIONS,
        "findings": [asdict(finding) for finding in robot.collision_findings],
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
