"""Checks of a requested problem: lengths of arrays, widths of limits, contradictions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from planner.errors import InvalidProblem, LimitsUnsatisfiable, MissingDynamics, Remedy
from planner.fields import BACK_END, FieldPath
from planner.guarantees import END_OPTIONS, HasCapabilities, MovesAtItsEnds, end_states, moves_at_its_ends
from planner.limits import SMALLEST, TOO_SMALL, Limits, limit_faults
from planner.problems.motion_around import FreeMotion
from planner.problems.payload_faults import payload_faults, refuse_payload_above_rating, tolerance_faults
from planner.problems.problem import (
    AnyWaypoint,
    CircularMotion,
    JointMotion,
    LinearMotion,
    PlanningProblem,
    PolylineMotion,
    SplineMotion,
)
from planner.problems.rides import ride_faults
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition
from planner.problems.waypoint_faults import (
    action_faults,
    objects_handled_faults,
    process_force_faults,
    tool_faults,
    vibration_faults,
    waypoint_faults,
)
from planner.robots import Robot
from planner.robots.payload import Payload
from planner.scene.scene import scene_faults
from planner.speed_zones import speed_zone_faults
from planner.tolerances import DURATION_TOLERANCE

TOOL_MOTIONS = {LinearMotion: "line", CircularMotion: "circle", PolylineMotion: "polyline", SplineMotion: "spline"}
"""The names of the tool motions in messages."""


def check_problem(problem: PlanningProblem, backend: HasCapabilities) -> None:
    """Check a problem against its robot: lengths of arrays, widths of limits, order of waypoints.

    Checks that need the solved waypoints are in `planner.paths`, such as a corner that the robot cannot pass.

    Args:
        problem: The requested problem.
        backend: The back end with its options, which may request motion at the ends (`MovesAtItsEnds`).

    Raises:
        InvalidProblem: With every fault found.
        MissingDynamics: The request limits torques of a robot whose torques are unknown.
        PayloadExceeded: The robot would carry more than its rated payload.
        LimitsUnsatisfiable: The requested motion at the ends, or the velocity at a passed waypoint, breaks a limit.
    """
    faults = list(_faults(problem))
    faults += vibration_faults(problem, backend)
    faults += _passing_faults(problem, backend)
    if moves_at_its_ends(backend):
        faults += _end_faults(problem, backend)
    if faults:
        raise InvalidProblem(faults)
    if not any(problem.payloads):
        refuse_unknown_torques(problem.robot, problem.all_limits)
    _refuse_heavy_payloads(problem)
    if moves_at_its_ends(backend):
        _refuse_impossible_ends(problem, backend)
    _refuse_impossible_passages(problem)


def refuse_unknown_torques(robot: Robot, requested: tuple[Limits, ...]) -> None:
    """Refuse a limit of torque or power that cannot be checked, rather than ignore it.

    Raises:
        MissingDynamics: The request has such a limit, and the robot has neither inertias nor a payload.
    """
    if robot.has_dynamics:
        return
    fields = {"torque": ("torque", "torque_range"), "power": ("power", "total_power"), "RMS torque": ("rms_torque",)}
    for quantity, names in fields.items():
        if any(getattr(limits, name) for limits in requested for name in names):
            raise MissingDynamics(
                f"{robot.id} has no link inertias and carries no payload: its {quantity} limits cannot be checked"
            )


def _faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    robot, waypoints = problem.robot, problem.waypoints
    if problem.scene is not None:
        yield from scene_faults(robot, problem.scene)
    yield from speed_zone_faults(problem.scene, problem.speed_zones)
    if not 0.0 <= problem.start_tolerance < np.inf:
        yield ("start_tolerance",), "must be finite and not negative"
    if not waypoints:
        yield ("waypoints",), "must have at least one waypoint"
    yield from waypoint_faults(robot, waypoints, problem.inverse_kinematics)
    if problem.roadmap is not None and problem.roadmap.positions.shape[1] != robot.dof:
        joints = problem.roadmap.positions.shape[1]
        yield ("roadmap",), f"must be of a robot with {robot.dof} joints; it has {joints}. Build one for this robot."
    for i, waypoint in enumerate(waypoints):
        if waypoint.limits is not None:
            yield from limit_faults(robot, waypoint.limits, ("waypoints", i, "limits"))
        if not 0.0 <= waypoint.dwell < np.inf:
            yield ("waypoints", i, "dwell"), f"must be finite and not negative; got {waypoint.dwell:g}"
        if waypoint.dwell > 0.0 and not isinstance(waypoint.transition, StopTransition):
            yield ("waypoints", i, "dwell"), "needs a stop: the robot rests only at a waypoint where it stops"
    yield from _payload_faults(problem)
    yield from objects_handled_faults(problem)
    yield from ride_faults(problem)
    yield from tool_faults(problem)
    yield from process_force_faults(problem)
    yield from action_faults(problem)
    for i in (0, len(waypoints) - 1):
        if waypoints and not isinstance(waypoints[i].transition, StopTransition):
            yield ("waypoints", i, "transition"), "must be a stop: the robot starts and ends at rest"
    if waypoints and type(waypoints[0].motion) is not JointMotion:
        yield ("waypoints", 0, "motion"), "the first waypoint ends no segment: there is no motion to it"
    if waypoints and waypoints[0].duration is not None:
        yield ("waypoints", 0, "duration"), "the first waypoint ends no segment: it has no duration"
    if waypoints and waypoints[0].limits is not None:
        yield ("waypoints", 0, "limits"), "the first waypoint ends no segment: it has no limits"
    yield from _free_motion_faults(problem)
    yield from _duration_faults(problem)
    yield from _optimise_faults(problem)
    yield from limit_faults(robot, problem.limits, ("limits",))


def _free_motion_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find free motions with an invalid budget or constraint."""
    for i, waypoint in enumerate(problem.waypoints):
        motion = waypoint.motion
        if not isinstance(motion, FreeMotion):
            continue
        for k, axis in enumerate(motion.keep):
            yield from axis.faults(("waypoints", i, "motion", "keep", k))
        for name in ("time_budget", "optimise_checks"):
            requested, field = getattr(motion, name), ("waypoints", i, "motion", name)
            if requested is not None and not 0.0 < requested < np.inf:
                yield field, "must be finite and greater than 0"
            elif requested is not None and motion.optimise is None:
                yield field, "needs `optimise`, the objective of the optimisation that it limits"


def _optimise_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find an unknown objective of the whole plan, budgets that limit nothing, and a duration that it cannot change."""
    if problem.optimise not in (None, "duration"):
        yield ("optimise",), f"must be `duration`; got {problem.optimise!r}"
    elif problem.optimise is not None and problem.duration is not None:
        yield ("optimise",), "cannot shorten a requested `duration` of the whole trajectory; leave one of them out"
    for name in ("time_budget", "optimise_iterates"):
        requested = getattr(problem, name)
        if requested is not None and not 0.0 < requested < np.inf:
            yield (name,), "must be finite and greater than 0"
        elif requested is not None and problem.optimise is None:
            yield (name,), "needs `optimise`, the objective of the optimisation that it limits"
    start, robot = problem.warm_start, problem.robot
    if start is not None and problem.optimise is None:
        yield ("warm_start",), "needs `optimise`, which begins there"
    if start is not None and start.coefficients.shape[1] != robot.dof:
        yield ("warm_start",), f"must have the {robot.dof} joints of {robot.id}; got {start.coefficients.shape[1]}"


def _duration_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find durations that contradict each other."""
    waypoints, whole = problem.waypoints, problem.duration
    if waypoints and waypoints[0].minimum_duration != 0.0:
        yield ("waypoints", 0, "minimum_duration"), "the first waypoint ends no segment: it has no duration"
    if waypoints and (waypoints[0].earliest_arrival != 0.0 or waypoints[0].latest_arrival is not None):
        name = "latest_arrival" if waypoints[0].latest_arrival is not None else "earliest_arrival"
        yield ("waypoints", 0, name), "must be left out: the robot starts at the first waypoint. Set its `dwell`."
    least = 0.0
    for i, waypoint in enumerate(waypoints):
        yield from _arrival_faults(waypoint, i, whole)
        if isinstance(waypoint.motion, FreeMotion) and (waypoint.duration or waypoint.minimum_duration):
            timed = "duration" if waypoint.duration else "minimum_duration"
            yield (
                ("waypoints", i, timed),
                "a free motion cannot have a duration of its own; set the `duration` of the whole trajectory",
            )
        if not 0.0 <= waypoint.minimum_duration < np.inf:
            yield ("waypoints", i, "minimum_duration"), "must be finite and not negative"
        elif waypoint.duration is not None and waypoint.duration < waypoint.minimum_duration:
            yield (
                ("waypoints", i, "duration"),
                f"must be at least the minimum_duration, {waypoint.minimum_duration:g} s",
            )
        least += waypoint.dwell + max(waypoint.minimum_duration, waypoint.duration or 0.0)
    all_timed = len(waypoints) > 1 and all(waypoint.duration is not None for waypoint in waypoints[1:])
    if whole is None:
        return
    if not SMALLEST <= whole < np.inf:
        yield ("duration",), TOO_SMALL
    elif whole < least * (1.0 - DURATION_TOLERANCE):
        yield ("duration",), f"the durations and dwells of the waypoints alone take {least:.10g} s"
    elif whole > least * (1.0 + DURATION_TOLERANCE) and all_timed:
        yield ("duration",), f"the durations and dwells of the waypoints add up to {least:.10g} s"


def _arrival_faults(waypoint: AnyWaypoint, index: int, whole: float | None) -> Iterator[tuple[FieldPath, str]]:
    """Find the faults of a time window."""
    earliest, latest = waypoint.earliest_arrival, waypoint.latest_arrival
    if not 0.0 <= earliest < np.inf:
        yield ("waypoints", index, "earliest_arrival"), f"must be finite and not negative; got {earliest:g}"
    elif earliest > 0.0 and whole is not None:
        yield ("waypoints", index, "earliest_arrival"), "must be left out with a `duration` of the whole trajectory"
    if latest is not None and not max(earliest, SMALLEST) <= latest < np.inf:
        least = "the earliest_arrival" if earliest > SMALLEST else "the shortest duration"
        text = f"must be finite and at least {least}, {max(earliest, SMALLEST):g} s; got {latest:g}"
        yield ("waypoints", index, "latest_arrival"), text


def _payload_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find payloads that are no bodies, that change where the robot does not stop, or whose tolerances cannot count."""
    if problem.payload is not None:
        yield from payload_faults(problem.payload, ("payload",))
    yield from tolerance_faults(problem)
    before = problem.payload
    for i, (waypoint, payload) in enumerate(zip(problem.waypoints, problem.payloads, strict=True)):
        field = "waypoints", i, "payload"
        if waypoint.payload is not None:
            yield from payload_faults(waypoint.payload, field)
        if waypoint.payload is not None and waypoint.put_down:
            yield field, "cannot be combined with put_down; a new payload replaces the one carried"
        if payload != before and not isinstance(waypoint.transition, StopTransition):
            yield (
                ("waypoints", i, "transition"),
                "must be a stop: the robot takes or puts down a payload only where it stops",
            )
        before = payload


def _refuse_heavy_payloads(problem: PlanningProblem) -> None:
    """Refuse payloads that exceed the rating of the robot; the remedies are the masses that it allows.

    Raises:
        PayloadExceeded: With the heaviest payload.
    """
    robot, waypoints = problem.robot, problem.waypoints
    carried: list[tuple[FieldPath, int, Payload | None]] = [
        (("waypoints", i, "payload"), i, waypoint.payload) for i, waypoint in enumerate(waypoints)
    ]
    if not waypoints or problem.payloads[0] is problem.payload:
        carried.insert(0, (("payload",), 0, problem.payload))
    heavy = [((*field, "mass"), i, body.largest_mass) for field, i, body in carried if body is not None]
    tolerances = [body.mass_tolerance for _, _, body in carried if body is not None]
    _, waypoint, mass = max(heavy, key=lambda one: one[2], default=((), 0, 0.0))
    spare = (robot.rated_payload or 0.0) - robot.payload_mass
    lighter = [
        Remedy(field, spare - tolerance, "the mass that the rating of the robot allows")
        for (field, _, own), tolerance in zip(heavy, tolerances, strict=True)
        if own > spare >= SMALLEST + 2.0 * tolerance
    ]
    refuse_payload_above_rating(robot, robot.payload_mass + mass, waypoint, lighter)


def _end_faults(problem: PlanningProblem, backend: MovesAtItsEnds) -> Iterator[tuple[FieldPath, str]]:
    """Find faults of a problem that contradict the requested motion at the ends."""
    robot, waypoints = problem.robot, problem.waypoints
    requested = {name: rates for name in END_OPTIONS if (rates := getattr(backend, name)) is not None}
    wrong = [name for name, rates in requested.items() if len(rates) != robot.dof]
    for name in wrong:
        yield (BACK_END, name), f"{len(requested[name])} values for the {robot.dof} joints of {robot.id}"
    if wrong or len(waypoints) < 2:
        return
    last = len(waypoints) - 1
    stops = [
        k for k, waypoint in enumerate(waypoints) if 0 < k < last and isinstance(waypoint.transition, StopTransition)
    ]
    until, since = min(stops, default=last), max(stops, default=0)
    ends = (END_OPTIONS[:2], 0, range(1, until + 1), "before"), (END_OPTIONS[2:], last, range(last, since, -1), "after")
    for names, end, nearest_first, side in ends:
        moving = [name for name in names if any(requested.get(name, ()))]
        if moving and waypoints[end].dwell > 0.0:
            yield ("waypoints", end, "dwell"), "must be 0: the request has motion at this waypoint"
        bound = next((k for k in nearest_first if not _is_free_in_joint_space(waypoints[k])), None)
        if bound is not None:
            kind = TOOL_MOTIONS.get(type(waypoints[bound].motion))
            what = f"the {kind} to waypoint {bound}" if kind else f"the blend at waypoint {bound}"
            message = f"{what} begins and ends at rest; add a joint motion {side} it, with a stop between them"
            yield from (((BACK_END, name), message) for name in moving)


def _passing_faults(problem: PlanningProblem, backend: HasCapabilities) -> Iterator[tuple[FieldPath, str]]:
    """Find requested passing velocities that the back end, or the motions there, cannot have."""
    waypoints, joints = problem.waypoints, problem.robot.dof
    stops = [k for k, waypoint in enumerate(waypoints) if isinstance(waypoint.transition, StopTransition)]
    for i, velocity in _passing_velocities(problem).items():
        field = "waypoints", i, "transition", "velocity"
        since, until = max((k for k in stops if k < i), default=0), min((k for k in stops if k > i), default=i)
        if len(velocity) != joints:
            yield field, f"{len(velocity)} values for the {joints} joints of {problem.robot.id}"
        elif not np.isfinite(velocity).all():
            yield field, "must be finite numbers"
        elif not any(velocity):
            yield field, "must not be zero: request a stop instead"
        elif not all(map(_is_free_in_joint_space, waypoints[since + 1 : until + 1])):
            yield field, "is possible only if all motions from stop to stop are joint motions without blends"
        elif not backend.capabilities.passes_with_velocities:
            yield (
                field,
                "this back end chooses its passing velocities; use ruckig, quintic or cubic to set them",
            )


def _passing_velocities(problem: PlanningProblem) -> dict[int, Sequence[float]]:
    """Return the requested passing velocities, by the index of the waypoint."""
    transitions = ((i, waypoint.transition) for i, waypoint in enumerate(problem.waypoints))
    return {i: t.velocity for i, t in transitions if isinstance(t, ThroughTransition) and t.velocity is not None}


def _refuse_impossible_passages(problem: PlanningProblem) -> None:
    """Check the requested passing velocities against the limits before and after the waypoint.

    Raises:
        LimitsUnsatisfiable: A velocity is beyond a limit.
    """
    requested = _passing_velocities(problem)
    lower, upper = problem.segment_limits().bounds("velocity") if requested else (np.empty(0), np.empty(0))
    for i, velocity in requested.items():
        least, most = lower[i - 1 : i + 1].max(axis=0), upper[i - 1 : i + 1].min(axis=0)
        values = np.array(velocity)
        kept = np.clip(values, least, most)
        if (values == kept).all():
            continue
        joint = int((values != kept).argmax())
        name, value, limit = problem.robot.joint_names[joint], float(values[joint]), float(kept[joint])
        field = "waypoints", i, "transition", "velocity"
        raise LimitsUnsatisfiable(
            f"the requested velocity of {name} at waypoint {i} is {value:.6g}, beyond its limit {limit:.6g}",
            waypoint=i,
            joint=name,
            value=value,
            limit=limit,
            remedies=[Remedy(field, tuple(kept.tolist()), "the velocity that the limits allow")],
        )


def _is_free_in_joint_space(waypoint: AnyWaypoint) -> bool:
    """Tell whether a back end may shape the motion to a waypoint, and past it, in joint space."""
    return isinstance(waypoint.motion, JointMotion) and not isinstance(waypoint.transition, BlendTransition)


def _refuse_impossible_ends(problem: PlanningProblem, backend: MovesAtItsEnds) -> None:
    """Check the requested motion at the ends against the limits of the first and the last segment.

    Raises:
        LimitsUnsatisfiable: The motion breaks a limit at once or later. An initial acceleration a leads to the velocity
            v + a |a| / (2 j) while the jerk limit j reduces it to zero.
    """
    ends = end_states(backend, problem.robot.dof)
    if not (ends.starts_moving or ends.ends_moving):
        return
    limits = problem.segment_limits()
    velocity, acceleration = ends.initial_velocity, ends.initial_acceleration
    bound_for = velocity + acceleration * np.abs(acceleration) / (2.0 * limits.jerk.upper[0])
    for option, quantity, segment, values, where in (
        ("initial_velocity", "velocity", 0, velocity, "at the start"),
        ("initial_acceleration", "acceleration", 0, acceleration, "at the start"),
        ("initial_acceleration", "velocity", 0, bound_for, "that its initial acceleration leads to"),
        ("final_velocity", "velocity", len(limits.velocity.upper) - 1, ends.final_velocity, "at the end"),
    ):
        lower, upper = (bound[segment] for bound in limits.bounds(quantity))
        limit = np.where(values < 0.0, -lower, upper)
        beyond = np.flatnonzero(np.abs(values) > limit)
        if not len(beyond):
            continue
        if values is bound_for:
            remedy = Remedy((BACK_END, option), None, "begin without acceleration")
        else:
            kept = tuple(np.clip(values, -limit, limit).tolist())
            remedy = Remedy((BACK_END, option), kept, "what the limits allow")
        joint = int(beyond[0])
        name, value = problem.robot.joint_names[joint], float(values[joint])
        raise LimitsUnsatisfiable(
            f"the {quantity} of {name} {where} is {value:.6g}, beyond its limit {limit[joint]:.6g}",
            segment=segment,
            joint=name,
            value=value,
            limit=float(limit[joint]),
            remedies=[remedy],
        )
