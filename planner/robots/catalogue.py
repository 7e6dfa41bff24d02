"""The robots of the catalogue: data files in `data/`, and robots of the package example-robot-data, if installed.

A data file has these fields:

- `source`: where the model comes from; `notes`: what its user should know, a list of sentences.
- `angles`: `degree` or `radian`, the unit of every angle in the file except in `geometry`.
- the model, one of
  - `dh`: `convention`, `joints` (the fields of `DHJoint`), and where they apply `base` and `tip`, positions in m,
  - `urdf`: a file beside it, or in `example_robot_data/` a path inside that package; `tip_frame`.
- `named_positions`: joint positions by name, angles of revolute joints; `home` is one from which the arm works.
- `rated_payload`: where the maker publishes one, its `mass`, kg, and the `source` in words.
- `limits`: for each quantity its `provenance` and its `source` in words (a document, or the rule of an estimate).
  Unless the URDF has them, also the `values` of each joint; of `position`, `lower` and `upper`. A continuous joint has
  null for them. The default rule fills in limits that neither file has.
- `velocity_curves`: by joint and direction (`upper`, `lower`), a list of `VelocityParabola` fields.
- `link_radii`: if the model has no collision shapes, the radii of the capsules derived from its kinematics, m. One
  radius is for the base, and one for the links of each joint.
- `collision`: in place of such capsules, convex outlines that contain the machine. Each has its `frame`, a `position`
  inside, and the `reach` from there in the directions of `outline_directions()`, m.
- `geometry`: shapes for display. `kind` is `box` (`size`), `cylinder` (`radius`, `length`, along z) or `sphere`
  (`radius`). Its centre is at `position`, turned by `rpy` (rad, as in URDF), in the frame `frame`.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from planner.errors import UnknownRobot
from planner.robots.checks import with_default_limits, with_velocity_curves
from planner.robots.collision.estimates import OUTLINE_UNCERTAINTY, Outline
from planner.robots.collision.geometry import CollisionElement, CollisionGeometry
from planner.robots.description import DRIVE_VALUES, Joint
from planner.robots.dh import DHJoint
from planner.robots.findings import Findings
from planner.robots.robot import Robot
from planner.robots.varying.velocity_curves import VelocityCurves, VelocityParabola
from planner.spatial import Pose

DATA = Path(__file__).parent / "data"
"""Folder of the robots that come with the library."""

PACKAGE = "example-robot-data"
"""Name of the package whose robots are offered where it is installed."""

PACKAGE_DATA = DATA / "example_robot_data"
"""Folder of additions to the robots of the package example-robot-data."""

PACKAGE_ROBOTS = "cmeel.prefix/share/example-robot-data/robots"
"""Folder of the robots within that package."""


@cache
def catalogue_ids() -> tuple[str, ...]:
    """List the robots that can be loaded.

    Returns:
        Their ids, in alphabetical order.

    Examples:
        >>> import planner
        >>> "kuka_kr16_2" in planner.catalogue_ids()
        True
    """
    return tuple(sorted(_files()))


@cache
def load_robot(id: str) -> Robot:
    """Load a robot of the catalogue; it is read once per process.

    Args:
        id: One of `catalogue_ids()`.

    Raises:
        UnknownRobot: No robot has this id; the message lists the known ids.

    Examples:
        >>> import planner
        >>> planner.load_robot("three_dof_arm").joint_names
        ('joint_1', 'joint_2', 'joint_3')
    """
    try:
        file, folder = _files()[id]
    except KeyError:
        raise UnknownRobot(f"there is no robot {id!r}; the robots are {', '.join(catalogue_ids())}") from None
    entry = json.loads(file.read_text(encoding="utf-8"))
    robot = _read_urdf(id, entry, folder) if "urdf" in entry else _read_dh(id, entry)
    limits, rated = entry["limits"], entry.get("rated_payload", {})
    joints = _with_curves(_with_limits(robot.joints, limits, _unit(entry)), entry.get("velocity_curves", {}))
    return replace(
        robot,
        joints=joints,
        collision=_collision(robot, joints, entry),
        limit_sources={quantity: limit["source"] for quantity, limit in limits.items() if "source" in limit},
        geometry=robot.geometry + tuple(entry.get("geometry", ())),
        named_positions={
            name: tuple(float(angle) * _unit(entry) for angle in angles)
            for name, angles in entry.get("named_positions", {}).items()
        },
        rated_payload=rated.get("mass"),
        rated_payload_source=rated.get("source"),
        notes=tuple(entry.get("notes", ())),
        findings=(),
    )


@cache
def _files() -> dict[str, tuple[Path, Path]]:
    """Return the data file of every robot that can be loaded, and the folder of the URDF it may name."""
    files = {file.stem: (file, DATA) for file in DATA.glob("*.json")}
    package = _package_robots()
    if package is not None:
        files |= {file.stem: (file, package) for file in PACKAGE_DATA.glob("*.json")}
    return files


@cache
def _package_robots() -> Path | None:
    """Return the folder in which the package example-robot-data keeps its robots; None: it is not installed."""
    try:
        return Path(str(distribution(PACKAGE).locate_file(PACKAGE_ROBOTS)))
    except PackageNotFoundError:
        return None


def _unit(entry: dict[str, Any]) -> float:
    """Return the file's unit of angle, rad."""
    return {"degree": math.pi / 180.0, "radian": 1.0}[entry["angles"]]


def _read_urdf(id: str, entry: dict[str, Any], folder: Path) -> Robot:
    urdf = (folder / entry["urdf"]).read_text(encoding="utf-8")
    meshes = folder.parent.parent  # of the package example-robot-data, whose meshes name it
    robot = Robot.from_urdf(urdf, id=id, tip_frame=entry["tip_frame"], meshes=meshes, source=entry["source"])
    # Friction in documents of the package keeps simulations stable: no maker has published it.
    without: dict[str, Any] = dict.fromkeys(DRIVE_VALUES, 0.0)
    return replace(robot, joints=tuple(replace(joint, **without) for joint in robot.joints))


def _collision(robot: Robot, joints: tuple[Joint, ...], entry: dict[str, Any]) -> CollisionGeometry | None:
    """Return the collision shapes of a robot, with additions from the data file."""
    if robot.collision is None:
        return None
    elements = robot.collision.elements + tuple(map(_outlined, entry.get("collision", ())))
    radii, travels = tuple(entry.get("link_radii", ())), [joint.travel for joint in joints]
    return replace(robot.collision, elements=elements, link_radii=radii, travels=travels)


def _outlined(part: dict[str, Any]) -> CollisionElement:
    """Return an outline of a data file as an estimate of what can collide."""
    placement = pin.SE3(np.eye(3), np.array(part["position"]))
    return CollisionElement(part["frame"], placement, Outline(tuple(part["reach"])), "estimate", OUTLINE_UNCERTAINTY)


def _read_dh(id: str, entry: dict[str, Any]) -> Robot:
    table, unit = entry["dh"], _unit(entry)
    joints = [{**row, **{key: row[key] * unit for key in ("theta", "alpha")}} for row in table["joints"]]
    base, tip = (Pose(np.array(table[end])) if end in table else None for end in ("base", "tip"))
    rows = [DHJoint(**joint) for joint in joints]
    robot = Robot.from_dh(rows, convention=table["convention"], base=base, tip=tip, id=id, source=entry["source"])
    if "gravity" in table:
        robot.model.gravity.linear = np.array(table["gravity"])
    return robot


def _with_limits(joints: tuple[Joint, ...], limits: dict[str, Any], unit: float) -> tuple[Joint, ...]:
    """Return joints with the limits of the data file, and default limits for the rest."""
    changed = []
    for i, joint in enumerate(joints):
        known: dict[str, Any] = {name: math.inf for name, origin in joint.provenance.items() if origin == "default"}
        provenance = {name: origin for name, origin in joint.provenance.items() if origin != "default"}
        for quantity, limit in limits.items():
            if quantity == "position" and joint.kind == "continuous":
                continue
            sides = ("lower", "upper") if quantity == "position" else ("values",)
            factor = unit if joint.is_angle and quantity != "torque" else 1.0
            values = {side: limit[side][i] * factor for side in sides if side in limit}
            known |= {quantity if side == "values" else side: value for side, value in values.items()}
            if values or quantity in provenance:
                provenance[quantity] = limit["provenance"]
        changed.append(with_default_limits(replace(joint, **known, provenance=provenance)))
    return tuple(changed)


def _with_curves(joints: tuple[Joint, ...], curves: dict[str, Any]) -> tuple[Joint, ...]:
    """Return the joints with the velocity curves of the data file."""

    def of(joint: Joint) -> VelocityCurves:
        own = curves.get(joint.name, {})
        return VelocityCurves(
            *(tuple(VelocityParabola(**curve) for curve in own.get(side, ())) for side in ("upper", "lower"))
        )

    return tuple(with_velocity_curves(joint, of(joint), Findings()) for joint in joints)
