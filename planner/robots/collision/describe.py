"""What of a robot can collide in plain words and numbers."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.robots.collision.pairs import MANY_POSITIONS, contacts, shapes_of_links
from planner.shapes import Box, Capsule, ConvexHull, Cylinder, Sphere
from planner.spatial import quaternion

if TYPE_CHECKING:
    from planner.robots.collision.geometry import LinkShape
    from planner.robots.collision.pairs import CollisionPair
    from planner.robots.robot import Robot
    from planner.shapes import Shape
    from planner.spatial import FloatArray

DRAWN_CORNERS = 160
"""The largest number of corners of a drawn hull.

With that many, round shapes look round, and the six pieces of a link's mesh take 50 kB as text.
"""


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
        "position": each.placement.translation.tolist(),
        "quaternion_xyzw": quaternion(each.placement.rotation).tolist(),
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
