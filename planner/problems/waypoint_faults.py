"""Checks of single waypoints."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import get_args

import numpy as np

from planner.fields import KIND, FieldPath
from planner.kinematics.configurations import Configuration, Elbow, Shoulder, Wrist, named_parts
from planner.kinematics.options import InverseKinematicsOptions, Preference
from planner.problems.motion_around import FreeMotion, Objective
from planner.problems.problem import (
    AnyWaypoint,
    CartesianMotion,
    Frame,
    JointMotion,
    JointWaypoint,
    PoseWaypoint,
    RelativeWaypoint,
    Singularity,
    Turns,
)
from planner.problems.regions import Region, region_faults
from planner.robots import Robot
from planner.spatial import Pose

CHOICES = (
    (JointMotion, "turns", Turns),
    (FreeMotion, "optimise", Objective),
    (CartesianMotion, "singularity", Singularity),
    (RelativeWaypoint, "frame", Frame),
    (Configuration, "shoulder", Shoulder),
    (Configuration, "elbow", Elbow),
    (Configuration, "wrist", Wrist),
    (InverseKinematicsOptions, "prefer", Preference),
)
"""Fields with a choice of names, besides their default: their class, name, and the choices."""


def waypoint_faults(
    robot: Robot, waypoints: Sequence[AnyWaypoint], options: InverseKinematicsOptions
) -> Iterator[tuple[FieldPath, str]]:
    """Find the faults of waypoints and of the options of the inverse kinematics."""
    yield from _choice_faults(options, ("inverse_kinematics",))
    for i, waypoint in enumerate(waypoints):
        yield from _choice_faults(waypoint, ("waypoints", i))
        yield from _choice_faults(waypoint.motion, ("waypoints", i, "motion"))
        if isinstance(waypoint, PoseWaypoint):
            yield from _choice_faults(waypoint.configuration, ("waypoints", i, "configuration"))
        if isinstance(waypoint, JointWaypoint) and len(waypoint.position) != robot.dof:
            count = len(waypoint.position)
            yield ("waypoints", i, "position"), f"{count} values for the {robot.dof} joints of {robot.id}"
        if isinstance(waypoint, JointWaypoint) and not np.isfinite(waypoint.position).all():
            yield ("waypoints", i, "position"), "must be finite numbers"
        if isinstance(waypoint, PoseWaypoint) and not _is_finite(waypoint.pose_in_base):
            yield ("waypoints", i, "pose"), "must be finite numbers"
        if isinstance(waypoint, PoseWaypoint) and waypoint.configuration.names:
            known = named_parts(robot)
            for part in waypoint.configuration.names:
                if part not in known:
                    has = f"the configurations of {robot.id} are named by {' and '.join(known) or 'nothing'}"
                    yield ("waypoints", i, "configuration", part), f"{has}, not by the {part}"
        if isinstance(waypoint, PoseWaypoint) and waypoint.free is not None and waypoint.pose.rotation is None:
            yield (
                ("waypoints", i, "free"),
                "needs a pose with an orientation: without one, every orientation is allowed",
            )
        if isinstance(waypoint, PoseWaypoint) and isinstance(waypoint.free, Region):
            yield from region_faults(waypoint.free, ("waypoints", i, "free"))
        if isinstance(waypoint, PoseWaypoint):
            yield from _pin_faults(robot, waypoint, ("waypoints", i, "external"))
        if isinstance(waypoint.motion, CartesianMotion) and isinstance(waypoint.motion.free, Region):
            yield from region_faults(waypoint.motion.free, ("waypoints", i, "motion", "free"), with_zero=True)
    if waypoints and isinstance(waypoints[0], RelativeWaypoint):
        yield ("waypoints", 0, KIND), "must not be relative: no waypoint is before the first one"
    if options.prefer == "near_reference" and options.reference is None:
        yield ("inverse_kinematics", "reference"), "is required with prefer = near_reference"
    if options.reference is not None and len(options.reference) != robot.dof:
        yield (
            ("inverse_kinematics", "reference"),
            f"{len(options.reference)} values for the {robot.dof} joints of {robot.id}",
        )


def _choice_faults(requested: object, field: FieldPath) -> Iterator[tuple[FieldPath, str]]:
    """Find values that are not among their choices; other code would treat them as one of them."""
    for kind, name, choices in CHOICES:
        if isinstance(requested, kind):
            value, known = getattr(requested, name), get_args(choices)
            if value not in (getattr(kind, name), *known):
                yield (*field, name), f"must be one of {', '.join(known)}; got {value!r}"
    if isinstance(requested, PoseWaypoint | CartesianMotion):
        free = requested.free
        if not (free is None or isinstance(free, Region) or free == "rotation_z"):
            yield (*field, "free"), f"must be rotation_z or a region; got {free!r}"


def _is_finite(pose: Pose) -> bool:
    return bool(np.isfinite(pose.position).all() and (pose.rotation is None or np.isfinite(pose.rotation).all()))


def _pin_faults(robot: Robot, waypoint: PoseWaypoint, field: FieldPath) -> Iterator[tuple[FieldPath, str]]:
    """Find faults of the fixed positions of external axes."""
    for name, value in (waypoint.external or {}).items():
        if name not in robot.external_axes:
            known = ", ".join(robot.external_axes) or "none"
            yield (*field, name), f"{robot.id} has no such external axis; it has {known}"
            continue
        joint = robot.joints[robot.joint_names.index(name)]
        if not joint.lower <= value <= joint.upper or not np.isfinite(value):
            yield (*field, name), f"outside of the limits of {name}, {joint.lower:.10g} to {joint.upper:.10g}"
