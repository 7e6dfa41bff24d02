"""Goal sets of many grasps beside the plan of the chosen grasp alone: processor time in one process."""

from __future__ import annotations

from dataclasses import replace
from statistics import median
from time import process_time
from typing import TYPE_CHECKING, Any

import numpy as np

import planner

if TYPE_CHECKING:
    from collections.abc import Callable

HOME = planner.JointWaypoint([0.0, -1.5, 1.5, -1.5, -1.5, 0.0])
LIFT = planner.RelativeWaypoint(planner.CartesianMove((0.0, 0.0, 0.1)), "base", motion=planner.LinearMotion())
TABLE = planner.SceneObject("table", [planner.HalfSpace([0.0, 0.0, 1.0], -0.05)])
CRATE = planner.SceneObject("crate", [planner.Box([0.1, 0.6, 0.3])], planner.Pose([0.5, 0.0, 0.5]))

CASES: dict[str, tuple[bool, planner.Motion, dict[str, Any]]] = {
    "one pose, nothing around": (False, planner.JointMotion(), {}),
    "a grasp, nothing around": (True, planner.JointMotion(), {}),
    "a grasp, the arm itself": (True, planner.JointMotion(), {"self_collision": True}),
    "a grasp in a scene": (True, planner.JointMotion(), {"scene": planner.Scene([TABLE, CRATE])}),
    "a grasp in a scene, free motions": (True, planner.FreeMotion(), {"scene": planner.Scene([TABLE, CRATE])}),
}
"""Whether each option has an approach, the motions in free space, and further fields of the problem."""


def measure(options: int, repeats: int, kind: str) -> dict[str, Any]:
    """Measure the processor times, ms, of plans with many options and with the chosen one alone."""
    robot = planner.load_robot("ur5e")
    figures: dict[str, Any] = {"options": options, "backend": kind, "cases": {}}
    for name, (has_approach, motion, fields) in CASES.items():
        rng = np.random.default_rng(1)
        grasps = [_grasp(rng, has_approach, motion) for _ in range(options)]
        end = replace(HOME, motion=motion)
        rest = [LIFT, end] if has_approach else [end]
        many = planner.PlanningProblem(robot, [HOME, planner.AnyOf(grasps), *rest], **fields)  # type: ignore[list-item]
        option = planner.plan(many, kind).choices[0].option
        alone = planner.PlanningProblem(robot, [HOME, *grasps[option or 0].waypoints, *rest], **fields)
        one = _time(lambda problem=alone: planner.plan(problem, kind), repeats)  # type: ignore[misc]
        every = _time(lambda problem=many: planner.plan(problem, kind), repeats)  # type: ignore[misc]
        figures["cases"][name] = {"one": one, "all": every, "ratio": every / one}
    return figures


def print_table(figures: dict[str, Any]) -> None:
    """Print the times for a person."""
    print(f"{figures['options']} options, {figures['backend']}, processor time in ms")
    for name, row in figures["cases"].items():
        print(f"{name:34} one {row['one']:7.1f}   all {row['all']:7.1f}   ratio {row['ratio']:5.2f}")


def _grasp(rng: np.random.Generator, has_approach: bool, motion: planner.Motion) -> planner.WaypointSequence:
    """Return a random grasp from above, with an approach of 0.1 m if requested."""
    turn = rng.uniform(-1.0, 1.0)
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.diag([1.0, -1.0, -1.0]) @ [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
    there = np.array([rng.uniform(0.3, 0.6), rng.uniform(-0.4, 0.4), rng.uniform(0.05, 0.3)])
    if not has_approach:
        return planner.WaypointSequence([planner.PoseWaypoint(planner.Pose(there, rotation), motion=motion)])
    above = planner.PoseWaypoint(planner.Pose(np.add(there, [0.0, 0.0, 0.1]), rotation), motion=motion)
    goal = planner.PoseWaypoint(planner.Pose(there, rotation), motion=planner.LinearMotion())
    return planner.WaypointSequence([above, goal])


def _time(plan: Callable[[], object], repeats: int) -> float:
    """Return the median processor time, ms, of several plans after a first one."""
    plan()
    times = []
    for _ in range(repeats):
        begun = process_time()
        plan()
        times.append(1e3 * (process_time() - begun))
    return median(times)
