"""Faults of waypoints, and of what happens only at stops or between them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import get_args

import numpy as np

from planner.fields import BACK_END, KIND, FieldPath
from planner.guarantees import END_OPTIONS, RAMP_OPTIONS, HasCapabilities
from planner.kinematics.configurations import Configuration, Elbow, Shoulder, Wrist, named_parts
from planner.kinematics.options import InverseKinematicsOptions, Preference
from planner.problems.actions import AtWaypoint, Wait
from planner.problems.motion_around import FreeMotion, Objective
from planner.problems.problem import (
    AnyWaypoint,
    CartesianMotion,
    Frame,
    JointMotion,
    JointWaypoint,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
    Singularity,
    Turns,
)
from planner.problems.regions import Region, region_faults
from planner.problems.rides import RideMotion, handling_of, object_of
from planner.problems.transitions import StopTransition
from planner.robots import Robot
from planner.scene.scene import Scene, handling_faults
from planner.spatial import Pose
from planner.tolerances import DURATION_TOLERANCE

MODE_RANGES = {"frequency": (0.1, 1000.0), "damping": (0.0, 0.2), "frequency_error": (0.0, 0.19)}
"""The least and the largest value of each number of a mode. With larger errors, three impulses leave more than 5 %."""


def action_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find actions at waypoints that do not exist, and waits longer than the dwell of their waypoint."""
    waited = [0.0] * len(problem.waypoints)
    for i, action in enumerate(problem.actions):
        at = action.at
        if isinstance(at, AtWaypoint) and not 0 <= at.waypoint < len(waited):
            yield ("actions", i, "at", "waypoint"), "must be the index of a waypoint of the request"
        elif isinstance(action, Wait) and not isinstance(at, AtWaypoint):
            yield ("actions", i, "at"), "must be a waypoint: the robot waits only at waypoints"
        elif isinstance(action, Wait) and isinstance(at, AtWaypoint):
            waited[at.waypoint] += action.duration
            dwell = problem.waypoints[at.waypoint].dwell
            if waited[at.waypoint] > dwell * (1.0 + DURATION_TOLERANCE):
                yield ("actions", i, "duration"), f"must fit into the dwell of the waypoint, {dwell:g} s"


def objects_handled_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find objects that the robot cannot take or put down at their waypoint."""
    if problem.scene is not None:
        riding = [object_of(waypoint) for waypoint in problem.waypoints]
        yield from handling_faults(problem.robot, problem.scene, handling_of(problem), riding)
        yield from _early_takes(problem, problem.scene)
    for i, (waypoint, done) in enumerate(zip(problem.waypoints, handling_of(problem), strict=True)):
        if not done.is_none and problem.scene is None:
            yield (
                ("waypoints", i, "attach" if done.taken else "detach"),
                "needs a scene with the objects",
            )
        elif not done.is_none and not isinstance(waypoint.transition, StopTransition):
            yield (
                ("waypoints", i, "transition"),
                "must be a stop: the robot takes or puts down an object only where it stops",
            )


def _early_takes(problem: PlanningProblem, scene: Scene) -> Iterator[tuple[FieldPath, str]]:
    """Find waypoints at which the robot may take a moving object before it stops."""
    stops = {thing.id: thing.motion.stop for thing in scene.objects if thing.motion is not None}
    earliest = 0.0
    for i, waypoint in enumerate(problem.waypoints):
        earliest = max(earliest, waypoint.earliest_arrival)
        for take in waypoint.attach:
            stop = stops.get(take.id)
            rides = object_of(waypoint) == take.id or isinstance(waypoint.motion, RideMotion)
            if stop is not None and earliest < stop and not rides:
                text = f"must be at least {stop:g} s, when {take.id!r} stops, here or at a waypoint before"
                yield ("waypoints", i, "earliest_arrival"), text


def process_force_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find process forces on no segment, on free motions, or that change where the robot does not stop."""
    waypoints = problem.waypoints
    if waypoints and waypoints[0].process_force is not None:
        yield ("waypoints", 0, "process_force"), "the first waypoint ends no segment: the tool exerts no force"
    for i, waypoint in enumerate(waypoints):
        field = "waypoints", i, "process_force"
        if waypoint.process_force is not None and isinstance(waypoint.motion, FreeMotion):
            yield field, "a free motion cannot have a process force; give its waypoint another motion"
        if waypoint.process_force is not None and not waypoint.process_force.is_finite:
            yield field, "must have finite numbers"
    for i, (before, after) in enumerate(pairwise(waypoints[1:]), 1):
        if before.process_force != after.process_force and not isinstance(before.transition, StopTransition):
            yield ("waypoints", i, "transition"), "must be a stop: the process force changes here"


def tool_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find waypoints with a tool change but no stop."""
    for i, (before, after) in enumerate(pairwise(problem.robots)):
        if before is not after and not isinstance(problem.waypoints[i].transition, StopTransition):
            text = "must be a stop: the tool changes here"
            yield ("waypoints", i, "transition"), text


def vibration_faults(problem: PlanningProblem, backend: HasCapabilities) -> Iterator[tuple[FieldPath, str]]:
    """Find faults of the requested mode, and fields that a shaped trajectory cannot keep."""
    mode = problem.residual_vibration
    if mode is None:
        return
    numbers = ((name, getattr(mode, name), *ends) for name, ends in MODE_RANGES.items())
    wrong = [each for each in numbers if not each[2] <= each[1] <= each[3]]
    for name, number, least, most in wrong:
        yield ("residual_vibration", name), f"must be from {least:g} to {most:g}; got {number:g}"
    if wrong or not mode.suppress:
        return
    instead = "or set `residual_vibration.suppress` to false, which only reports the vibration."
    for i, waypoint in enumerate(problem.waypoints):
        if not isinstance(waypoint.transition, StopTransition):
            message = "must be a stop: suppression of residual vibration shapes motions from stop to stop. Stop here, "
            yield ("waypoints", i, "transition"), message + instead
        if waypoint.duration is not None:
            message = (
                f"must be left out: suppression of residual vibration lengthens each motion by {mode.period:.4g} s; "
                f"got {waypoint.duration:g}. Set a `minimum_duration` or the `duration` of the whole trajectory, "
            )
            yield ("waypoints", i, "duration"), message + instead
    for name in END_OPTIONS:
        if any(getattr(backend, name, None) or ()):
            message = "must be rest: suppression of residual vibration shapes motions from rest to rest. Leave it out, "
            yield (BACK_END, name), message + instead
    for name in RAMP_OPTIONS:
        if getattr(backend, name, None) is not None:
            message = (
                f"must be left out: suppression of residual vibration lengthens ramps by {mode.period:.4g} s; got "
                f"{getattr(backend, name):g}. Limit the acceleration instead, "
            )
            yield (BACK_END, name), message + instead


CHOICES = (
    (JointMotion, "turns", get_args(Turns)),
    (FreeMotion, "optimise", get_args(Objective)),
    (CartesianMotion, "singularity", get_args(Singularity)),
    (RelativeWaypoint, "frame", get_args(Frame)),
    (Configuration, "shoulder", get_args(Shoulder)),
    (Configuration, "elbow", get_args(Elbow)),
    (Configuration, "wrist", get_args(Wrist)),
    (InverseKinematicsOptions, "prefer", get_args(Preference)),
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
    if options.prefer == "weld_flat" and (robot.holds_workpiece or not robot.positioner):
        yield ("inverse_kinematics", "prefer"), f"weld_flat needs a robot with a positioner; {robot.id} has none"
    if options.reference is not None and len(options.reference) != robot.dof:
        yield (
            ("inverse_kinematics", "reference"),
            f"{len(options.reference)} values for the {robot.dof} joints of {robot.id}",
        )


def _choice_faults(requested: object, field: FieldPath) -> Iterator[tuple[FieldPath, str]]:
    """Find values that are not among their choices; other code would treat them as one of them."""
    for kind, name, known in CHOICES:
        if isinstance(requested, kind):
            value = getattr(requested, name)
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
