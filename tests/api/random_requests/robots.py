"""Robots for random requests: cheap ones of the catalogue, one with shapes, and derived ones."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from planner.robots import ExternalAxis, Robot, load_robot
from planner.spatial import Pose

if TYPE_CHECKING:
    from collections.abc import Sequence

CATALOGUE: Sequence[str] = ("three_dof_arm", "ngv_refuelling_arm", "date_sorting_arm", "kuka_kr16_2")

EXTERNAL = "carrier"
"""The name of the external axis that some robots have."""

LINK = """
<link name="l{k}"><inertial><origin xyz="0 0 {half}"/><mass value="{mass}"/>
<inertia ixx="0.05" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.02"/></inertial>
<collision><origin xyz="0 0 {half}"/><geometry>{shape}</geometry></collision></link>
<joint name="j{k}" type="revolute"><parent link="l{before}"/><child link="l{k}"/><origin xyz="0 0 {at}"/>
<axis xyz="{axis}"/><limit lower="-2.5" upper="2.5" effort="150" velocity="2"/></joint>"""
"""A link with a shape, and the joint that moves it."""

SHAPES = (
    ("0 0 1", 0.2, 0.1, '<cylinder radius="0.06" length="0.2"/>'),
    ("0 1 0", 0.2, 0.4, '<box size="0.08 0.1 0.36"/>'),
    ("0 1 0", 0.4, 0.3, '<cylinder radius="0.05" length="0.28"/>'),
    ("0 0 1", 0.3, 0.05, '<sphere radius="0.05"/>'),
)
"""The axes of the joints of the arm, the lengths of the link before and of the link (m), and its shape."""


def arm_of_shapes() -> str:
    """Return a URDF document of four joints whose links are cylinders, a box and a ball, with masses."""
    links = [
        LINK.format(k=k, before=k - 1, axis=axis, at=at, half=length / 2.0, mass=4.0 / k, shape=shape)
        for k, (axis, at, length, shape) in enumerate(SHAPES, 1)
    ]
    return f'<robot name="arm_of_shapes"><link name="l0"/>{"".join(links)}</robot>'


def made_up_robot(random: np.random.Generator, name: str) -> tuple[Robot, dict[str, Any] | None]:
    """Return a robot for requests by name, and the body that adds it; None: it is in the catalogue."""
    kind = int(random.integers(8))
    if kind < len(CATALOGUE):
        return load_robot(CATALOGUE[kind]), None
    if kind == len(CATALOGUE):
        urdf = arm_of_shapes()
        return Robot.from_urdf(urdf, id=name), {"kind": "urdf", "id": name, "urdf": urdf}
    base = load_robot(CATALOGUE[int(random.integers(len(CATALOGUE)))])
    body = {"kind": "derived", "id": name, "from": base.id, **_changes(base, random)}
    changes = {key: value for key, value in body.items() if key not in ("kind", "id", "from")}
    for key in ("tool", "mounting"):
        if key in changes:
            turn = changes[key]["orientation"]["rpy"]
            rotation = Rotation.from_euler("xyz", turn).as_matrix()
            changes[key] = Pose(np.array(changes[key]["position"]), rotation)
    changes["external_axes"] = [ExternalAxis(**axis) for axis in changes.get("external_axes", [])]
    return base.derived(id=name, **changes), body


def _changes(base: Robot, random: np.random.Generator) -> dict[str, Any]:
    """Return changes for a derived robot: limits, a fixed joint, a tool and a mounting."""
    changes: dict[str, Any] = {}
    names = list(base.joint_names)
    if len(names) > 3 and random.random() < 0.25:
        held = names.pop(int(random.integers(len(names))))
        k = base.joint_names.index(held)
        changes["locked"] = {held: float(np.clip(random.normal(), base.limit("lower")[k], base.limit("upper")[k]))}
    limits: dict[str, dict[str, Any]] = {}
    for name in names:
        if random.random() < 0.5:
            joint = base.joints[base.joint_names.index(name)]
            share = random.uniform(0.2, 1.0)
            limits[name] = {"velocity": joint.velocity * share, "acceleration": joint.acceleration * share}
            if random.random() < 0.3:
                own = joint.acceleration * share
                limits[name]["acceleration_range"] = [-0.5 * own, own]
            if random.random() < 0.3:
                limits[name] |= {"lower": max(joint.lower, -1.5), "upper": min(joint.upper, 2.0)}
    if limits:
        changes["limits"] = limits
    if random.random() < 0.15:
        kind = ("prismatic", "revolute", "continuous")[int(random.integers(3))]
        bounds = {} if kind == "continuous" else {"lower": -1.0, "upper": 2.0}
        axis = np.eye(3)[int(random.integers(3))] if random.random() < 0.5 else random.normal(size=3)
        made = {"name": EXTERNAL, "kind": kind, "axis": axis.tolist(), "velocity": 1.0, "acceleration": 2.0, **bounds}
        changes["external_axes"] = [{**made, "jerk": 20.0, "mass": float(random.choice([0.0, 60.0]))}]
    for key in ("tool", "mounting"):
        if random.random() < 0.4:
            position, turn = (0.2 * random.normal(size=3)).tolist(), (0.5 * random.normal(size=3)).tolist()
            changes[key] = {"position": position, "orientation": {"kind": "rpy", "rpy": turn}}
    return changes
