"""Problems that several tests plan."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import strategies as st

from planner.backends import BACKENDS
from planner.problem import JointWaypoint, Limits, PlanningProblem
from planner.robots import Robot, load_robot

ARMS = ("ngv_refuelling_arm", "date_sorting_arm", "three_dof_arm", "kuka_kr16_l6_2")

ARMS_OF = {"min_effort": ("kuka_kr16_l6_2",)}
"""The arms of a back end that asks more of an arm: inertias."""

OPTIONS_OF: dict[str, dict[str, object]] = {"min_effort": {"knots": 8}}
"""Of a back end that takes longer than others with its defaults."""


def random_position(robot: Robot, rng: np.random.Generator) -> tuple[float, ...]:
    """Within the limits; within half a turn where there are none."""
    lower = np.maximum(robot.limit("lower"), -np.pi)
    upper = np.minimum(robot.limit("upper"), np.pi)
    return tuple(rng.uniform(lower, upper).tolist())


def problem_of(robot_id: str, kind: str, seed: int, count: int, scale: float = 1.0) -> PlanningProblem:
    """`count` random joint waypoints whose spread shrinks with `scale`."""
    robot, rng = load_robot(robot_id), np.random.default_rng(seed)
    first = np.array(random_position(robot, rng))
    positions = [first] + [first + scale * (np.array(random_position(robot, rng)) - first) for _ in range(count - 1)]
    waypoints = tuple(JointWaypoint(position=tuple(q.tolist())) for q in positions)
    return PlanningProblem(robot, waypoints, BACKENDS[kind](**OPTIONS_OF.get(kind, {})))


@st.composite
def problems(draw: st.DrawFn, kind: str) -> PlanningProblem:
    """Joint waypoints of any spread, with dwells, scaled and per-segment limits."""
    robot_id = draw(st.sampled_from(ARMS_OF.get(kind, ARMS)))
    scale = 10.0 ** draw(st.floats(-6.0, 0.0))
    problem = problem_of(robot_id, kind, draw(st.integers(0, 2**32)), draw(st.integers(2, 8)), scale)
    waypoints = list(problem.waypoints)
    for i in range(len(waypoints)):
        waypoints[i] = replace(waypoints[i], dwell=draw(st.sampled_from([0.0, 0.0, 0.25, 3.0])))
        if i > 0 and draw(st.booleans()):
            own = Limits(
                velocity=tuple((problem.robot.limit("velocity") * draw(st.floats(0.05, 1.0))).tolist()),
                acceleration_scale=draw(st.floats(0.05, 1.0)),
            )
            waypoints[i] = replace(waypoints[i], limits=own)
    limits = Limits(velocity_scale=draw(st.floats(0.01, 1.0)), acceleration_scale=draw(st.floats(0.01, 1.0)))
    return replace(problem, waypoints=tuple(waypoints), limits=limits)
