"""Problems shared by several tests."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

from planner.backends import BACKENDS, BackEnd, Cubic, MinEffort, Quintic, Ruckig, Toppra, Trapezoidal
from planner.kinematics import Pose, configurations, forward_kinematics
from planner.kinematics.options import InverseKinematicsOptions, Preference
from planner.limits import Limits
from planner.paths import JointPath
from planner.plans.result import Plan, certified, timed
from planner.problems.actions import Action, AtDistance, AtTime, AtWaypoint, SetOutput, Wait
from planner.problems.motion_around import FreeMotion
from planner.problems.problem import (
    AnyWaypoint,
    CircularMotion,
    JointMotion,
    JointWaypoint,
    LinearMotion,
    Motion,
    PlanningProblem,
    PolylineMotion,
    PoseWaypoint,
    Singularity,
    SplineMotion,
)
from planner.problems.regions import Free, Region
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition, Transition
from planner.robots import Robot, load_robot
from planner.robots.payload import Payload
from planner.spatial import rotation_from_rpy
from tests.sizes import SIZE

REQUESTS = int(os.environ.get("REQUESTS") or SIZE.requests)
"""Number of random requests for the properties of each back end, a tenth of them along paths of the tool."""

PARTS = range(4)
"""Number of tests that share them, which can run side by side, each with random numbers of its own."""

PARTS_CARRIED = (Payload(1.0, (0.0, 0.0, 0.1)), Payload(4.0, (0.05, 0.0, 0.1), (0.02, 0.02, 0.01)))
"""Parts that arms with inertias pick up."""

WORK_OBJECT = Pose.from_rpy([0.3, -0.2, 0.1], [0.2, -0.4, 1.0])
"""A frame for every second pose."""

TOOLS = (Pose([0.0, 0.02, 0.12]), Pose.from_rpy([0.05, 0.0, 0.2], [0.0, 0.6, 0.0]))
"""Tools of arms with tool changes."""

REGIONS: tuple[Free, ...] = (
    "rotation_z",
    Region(rotation_z=(-0.5, 0.5)),
    Region(z=(-0.01, 0.02)),
    Region(x=(0.0, 0.01), y=(-0.02, 0.0), rotation_x=(-0.2, 0.1), rotation_y=(0.0, 0.3), rotation_z=(-0.1, 0.1)),
)
"""Tolerance regions of poses."""

LEAST_DURATIONS = (0.0, 0.0, 0.0, 0.1, 2.0)
"""Requested least durations of segments, s."""

RANGES = (None, None, (0.3, 1.0), (1.0, 0.6))
"""Shares of limits downwards and upwards, which may differ."""

Check = Callable[[PlanningProblem], None]
"""A check that fails if a problem's plan breaks a property."""

ARMS = ("ngv_refuelling_arm", "date_sorting_arm", "three_dof_arm", "kuka_kr16_l6_2")

ARMS_OF = {"min_effort": ("kuka_kr16_l6_2",)}
"""The arms of a back end that needs inertias."""

MOST_WAYPOINTS_OF = {"min_effort": 3}
"""The most waypoints for a slower back end; the others have 8."""

OPTIONS_OF: dict[str, dict[str, object]] = {"min_effort": {"knots": 8, "max_joint_deviation": 0.3}}
"""Options of a slower back end, smaller than its defaults, and the properties that these leave out."""


ALL_BACK_ENDS: tuple[BackEnd, ...] = (
    Cubic(),
    Quintic(),
    Trapezoidal(),
    Ruckig(),
    Toppra(),
    Toppra(jerk_limited=True),
    MinEffort(),
)
"""Every back end that times a path itself, `toppra` with and without limits of jerk."""

BACK_END_NAMES = tuple(f"{own.kind}-{getattr(own, 'jerk_limited', '')}" for own in ALL_BACK_ENDS)
"""Their names in parametrized tests."""


def backend_of(kind: str) -> BackEnd:
    """Return the back end of a kind, with options that make it about as fast as the others."""
    return BACKENDS[kind](**OPTIONS_OF.get(kind, {}))


def try_on_random(examples: int, part: int, problem: st.SearchStrategy[PlanningProblem], check: Check) -> None:
    """Check some of the requests of a part, the same ones each time."""

    @seed(part)
    @settings(max_examples=examples, deadline=None, suppress_health_check=list(HealthCheck))
    @given(problem=problem)
    def trial(problem: PlanningProblem) -> None:
        check(problem)

    trial()


def random_position(robot: Robot, rng: np.random.Generator) -> tuple[float, ...]:
    """Draw a joint position within the limits, or within half a turn where there are none."""
    lower = np.maximum(robot.limit("lower"), -np.pi)
    upper = np.minimum(robot.limit("upper"), np.pi)
    return tuple(rng.uniform(lower, upper).tolist())


def problem_of(robot_id: str, seed: int, count: int, scale: float = 1.0) -> PlanningProblem:
    """Draw `count` random joint waypoints whose spread shrinks with `scale`."""
    robot, rng = load_robot(robot_id), np.random.default_rng(seed)
    first = np.array(random_position(robot, rng))
    positions = [first] + [first + scale * (np.array(random_position(robot, rng)) - first) for _ in range(count - 1)]
    waypoints = tuple(JointWaypoint(position=tuple(q.tolist())) for q in positions)
    return PlanningProblem(robot, waypoints)


@st.composite
def problems(draw: st.DrawFn, kind: str) -> PlanningProblem:
    """Draw joint waypoints for a kind of back end, with dwells, payloads, scaled and per-segment limits."""
    robot_id = draw(st.sampled_from(ARMS_OF.get(kind, ARMS)))
    scale = 10.0 ** draw(st.floats(-6.0, 0.0))
    most = MOST_WAYPOINTS_OF.get(kind, 8)
    problem = problem_of(robot_id, draw(st.integers(0, 2**32)), draw(st.integers(2, most)), scale)
    waypoints = list(problem.waypoints)
    for i in range(len(waypoints)):
        waypoints[i] = replace(waypoints[i], dwell=draw(st.sampled_from([0.0, 0.0, 0.25, 3.0])))
        if i > 0 and draw(st.booleans()):
            own = Limits(
                velocity=tuple((problem.robot.limit("velocity") * draw(st.floats(0.05, 1.0))).tolist()),
                acceleration_scale=draw(st.floats(0.05, 1.0)),
            )
            waypoints[i] = replace(waypoints[i], limits=own)
        if i > 0:
            waypoints[i] = replace(waypoints[i], minimum_duration=draw(st.sampled_from(LEAST_DURATIONS)))
            if not waypoints[i].minimum_duration and draw(st.sampled_from([False, False, False, True])):
                waypoints[i] = replace(waypoints[i], motion=FreeMotion())
        if problem.robot.has_dynamics:
            taken = draw(st.sampled_from([None, None, *PARTS_CARRIED]))
            waypoints[i] = replace(waypoints[i], payload=taken, put_down=taken is None and draw(st.booleans()))
        waypoints[i] = replace(waypoints[i], tool=draw(st.sampled_from([None, None, None, *TOOLS])))
    # With tool speeds a search takes seconds.
    no_speeds = [None] * (8 if kind in MOST_WAYPOINTS_OF else 3)
    limits = Limits(
        velocity_scale=draw(st.floats(0.01, 1.0)),
        acceleration_scale=draw(st.floats(0.01, 1.0)),
        tcp_linear_velocity=draw(st.sampled_from([*no_speeds, 0.05, 0.5])),
        tcp_angular_velocity=draw(st.sampled_from([*no_speeds, 0.2, 2.0])),
        tcp_linear_acceleration=draw(st.sampled_from([*no_speeds, *no_speeds, 0.2, 3.0])),
        tcp_angular_acceleration=draw(st.sampled_from([*no_speeds, *no_speeds, 0.5, 5.0])),
        tcp_centripetal_acceleration=draw(st.sampled_from([*no_speeds, *no_speeds, 0.1, 1.0])),
        tcp_linear_jerk=draw(st.sampled_from([*no_speeds, *no_speeds, 1.0, 30.0])),
        tcp_angular_jerk=draw(st.sampled_from([*no_speeds, *no_speeds, 2.0, 50.0])),
        velocity_range=_ranges(problem.robot, "velocity", draw(st.sampled_from(RANGES))),
        acceleration_range=_ranges(problem.robot, "acceleration", draw(st.sampled_from(RANGES))),
    )
    actions = _actions(waypoints, draw(st.lists(st.integers(0, 2**16), max_size=3)))
    return replace(problem, waypoints=tuple(waypoints), limits=limits, actions=actions)


def _actions(waypoints: list[AnyWaypoint], drawn: list[int]) -> tuple[Action, ...]:
    """Return outputs and waits at waypoints, and outputs at the start by distance and time, from drawn numbers."""
    actions: list[Action] = []
    for number in drawn:
        at = AtWaypoint(number % len(waypoints))
        dwell = waypoints[at.waypoint].dwell
        if number % 3 == 0 and dwell > 0.0:
            actions.append(Wait(at, dwell / 4.0))
        else:
            moments = (at, AtTime(0.0), AtDistance(0.0))
            actions.append(SetOutput(moments[number % 5 % 3], "x", bool(number % 2)))
    return tuple(actions)


def _ranges(robot: Robot, quantity: str, shares: tuple[float, float] | None) -> tuple[tuple[float, float], ...] | None:
    """Return the joints' limits with every second one reversed, or None for the robot's own."""
    if shares is None:
        return None
    limits = np.minimum(robot.limit(quantity), 1e3).tolist()
    return tuple((-shares[k % 2] * limit, shares[(k + 1) % 2] * limit) for k, limit in enumerate(limits))


@st.composite
def path_problems(draw: st.DrawFn, kind: str) -> PlanningProblem:
    """Draw poses around a random joint position, with motions and transitions of all kinds, for a kind of back end."""
    robot = load_robot(draw(st.sampled_from(ARMS_OF.get(kind, ARMS))))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    first = 0.7 * np.array(random_position(robot, rng)) + 0.3 * robot.middle
    home = forward_kinematics(robot, first[None])[0]
    (named,) = configurations(robot, [first])
    reach = 10.0 ** draw(st.floats(-3.0, -0.5)) * (0.15 if robot.dof == 3 else 1.0)
    count = draw(st.integers(2, 5))
    waypoints: list[AnyWaypoint] = [JointWaypoint(position=tuple(first.tolist()))]
    before: Motion = JointMotion()
    for k in range(1, count):
        near: Singularity = draw(st.sampled_from(["refuse", "refuse", "slow", "deviate"]))
        via = [_near(home, robot, rng, reach) for _ in range(3)]
        made: Motion = draw(
            st.sampled_from(
                [
                    JointMotion(),
                    LinearMotion(singularity=near),
                    LinearMotion(free=REGIONS[k % 2]),
                    CircularMotion(via[0], singularity=near),
                    PolylineMotion(via, 0.1 * reach, singularity=near),
                    SplineMotion(via, singularity=near),
                ]
            )
        )
        requested = named.of_parts(draw(st.sampled_from([(), (), ("shoulder", "elbow"), ("wrist",)])))
        goal, frame = _near(home, robot, rng, reach), WORK_OBJECT if k % 2 == 0 else None
        free = REGIONS[rng.integers(len(REGIONS))] if robot.dof > 3 and rng.random() < 0.3 else None
        pose = goal if frame is None else goal.to_frame(frame)
        least = float(rng.choice(LEAST_DURATIONS))
        waypoints.append(PoseWaypoint(pose, requested, frame, free, motion=made, minimum_duration=least))
        if k > 1:
            both_tool = not isinstance(before, JointMotion) and not isinstance(made, JointMotion)
            kinds = ["stop", "blend"] if both_tool else ["stop", "blend", "through"]
            waypoints[k - 1] = replace(waypoints[k - 1], transition=draw(_transitions(kinds, reach)))
        if isinstance(waypoints[k - 1].transition, StopTransition) and rng.random() < 0.2:
            tool = TOOLS[rng.integers(len(TOOLS))]
            here = robot.with_tool(tool)  # whose poses are near to where this tool is at the first waypoint
            home = forward_kinematics(here, first[None])[0]
            goal = _near(home, robot, rng, reach)
            via = [_near(home, robot, rng, reach) for _ in range(3)]
            if isinstance(made, CircularMotion):
                made = replace(made, via=via[0])
            elif isinstance(made, PolylineMotion | SplineMotion):
                made = replace(made, poses=via)
            pose = goal if frame is None else goal.to_frame(frame)
            waypoints[k] = replace(waypoints[k], pose=pose, tool=tool, motion=made)
        before = made
    scale = draw(st.floats(0.05, 1.0))
    speed = draw(st.sampled_from([None, None, 0.05, 0.5]))
    limits = Limits(
        velocity_scale=scale,
        acceleration_scale=scale,
        tcp_linear_velocity=speed,
        tcp_linear_acceleration=rng.choice([None, None, 0.2, 3.0]),
        tcp_angular_acceleration=rng.choice([None, None, 0.5, 5.0]),
        tcp_centripetal_acceleration=rng.choice([None, None, 0.1, 1.0]),
        tcp_linear_jerk=rng.choice([None, None, None, 1.0, 30.0]),
        tcp_angular_jerk=rng.choice([None, None, None, 2.0, 50.0]),
        velocity_range=_ranges(robot, "velocity", RANGES[rng.integers(len(RANGES))]),
        acceleration_range=_ranges(robot, "acceleration", RANGES[rng.integers(len(RANGES))]),
    )
    prefer: Preference = rng.choice(["continuous", "continuous", "near_reference", "manipulability", "far_from_limits"])
    reference = tuple(first.tolist()) if prefer == "near_reference" else None
    options = InverseKinematicsOptions(prefer=prefer, reference=reference)
    return PlanningProblem(robot, tuple(waypoints), limits, options)


def _near(home: Pose, robot: Robot, rng: np.random.Generator, reach: float) -> Pose:
    assert home.rotation is not None
    position = home.position + reach * rng.uniform(-1.0, 1.0, 3)
    if robot.dof == 3:
        return Pose(position)
    return Pose(position, home.rotation @ rotation_from_rpy(*rng.uniform(-0.5, 0.5, 3)))


@st.composite
def _transitions(draw: st.DrawFn, kinds: list[str], reach: float) -> Transition:
    match draw(st.sampled_from(kinds)):
        case "stop":
            return StopTransition()
        case "through":
            return ThroughTransition()
        case _:
            return BlendTransition(reach * draw(st.floats(0.05, 1.5)))


def certified_plan(problem: PlanningProblem, backend: BackEnd, path: JointPath) -> Plan:
    """Plan along a solved path, without remedies."""
    return certified(problem, backend, path, timed(problem, backend, path))
