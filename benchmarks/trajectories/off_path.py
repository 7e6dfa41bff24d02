"""Plans with an optimised duration, beside multi-start searches with the closed form of the duration."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import minimize

import planner
from benchmarks.machine import machine
from planner.kinematics.forward import jacobian
from planner.problems.regions import Region
from planner.problems.transitions import StopTransition, Transition

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.spatial import FloatArray

POSES = (2, 4)
"""The numbers of poses of the problems, by turns."""

UNSOLVED = 1e3
"""The duration, s, that stands for a pose without a solution."""

WITHIN = 1.05
"""The largest duration beside the best of the searches."""

EVALUATIONS = 400
"""The most evaluations of one Nelder-Mead search; then the next one begins elsewhere."""

REGION = Region(x=(-0.02, 0.02), rotation_z=(-1.0, 1.0))
"""A shift of 20 mm and a turn of 1 rad to either side."""


def through_poses(
    robot: planner.Robot, seed: int, poses: int, transition: Transition = StopTransition(), free: Region | None = None
) -> planner.PlanningProblem:
    """Make a problem from one random joint position through poses to another; the arm reaches all."""
    rng = np.random.default_rng(seed)
    lower, upper = np.maximum(robot.limit("lower"), -2.0), np.minimum(robot.limit("upper"), 2.0)
    middle = (lower + upper) / 2.0
    positions = [middle + 0.3 * (upper - lower) * (rng.random(robot.dof) - 0.5)]
    for _ in range(poses + 1):
        positions.append(np.clip(positions[-1] + 0.4 * rng.normal(size=robot.dof), lower, upper))
    between = [
        planner.PoseWaypoint(planner.forward_kinematics(robot, q), free=free, transition=transition)
        for q in positions[1:-1]
    ]
    ends = [planner.JointWaypoint(q.tolist()) for q in (positions[0], positions[-1])]
    return planner.PlanningProblem(robot, [ends[0], *between, ends[1]])


def trapezoidal_duration(robot: planner.Robot, positions: FloatArray) -> float:
    """Return the time, s, of straight motions from rest to rest, each with one trapezoid within all joints' limits."""
    velocity, acceleration = robot.limit("velocity"), robot.limit("acceleration")
    total = 0.0
    for step in np.abs(np.diff(positions, axis=0)):
        speed, rate = 1.0 / (step / velocity).max(), 1.0 / (step / acceleration).max()
        total += 1.0 / speed + speed / rate if speed**2 < rate else 2.0 / rate**0.5
    return total


def durations_by_search(
    problem: planner.PlanningProblem, free: Region | None, evaluations: int, seed: int
) -> Iterator[float]:
    """Yield the shortest durations of trapezoids, s, of one Nelder-Mead search after the other.

    The variables are offsets in the region and shifts of the elbow. Half of the searches begin in random
    configurations.
    """
    robot, rng = problem.robot, np.random.default_rng(seed)
    path = planner.plan(problem, "trapezoidal").path.positions
    waypoints = [(k, w) for k, w in enumerate(problem.waypoints) if isinstance(w, planner.PoseWaypoint)]
    ranges = np.array([*free.ranges.values()]) if free is not None else np.zeros((0, 2))
    dims, bases = len(ranges) + robot.dof - 6, path

    def duration(x: FloatArray) -> float:
        """Return the duration, s, at shares of ranges and shifts of the elbow."""
        positions = path.copy()
        for (k, waypoint), own in zip(waypoints, x.reshape(-1, dims), strict=True):
            shares, elbow = np.clip(own[: len(ranges)], 0.0, 1.0), own[len(ranges) :]
            pose = waypoint.pose
            if free is not None:
                pose = free.pose(pose, ranges[:, 0] + shares * (ranges[:, 1] - ranges[:, 0]))
            idle = np.linalg.svd(jacobian(robot, bases[k]))[2][6:]
            near = np.clip(bases[k] + elbow @ idle, robot.limit("lower"), robot.limit("upper"))
            solved = planner.inverse_kinematics(robot, pose, reference=near)
            if solved.status != "solved":
                return UNSOLVED
            positions[k] = solved.position
        return trapezoidal_duration(robot, positions)

    while True:
        start = rng.random(len(waypoints) * dims)
        yield float(minimize(duration, start, method="Nelder-Mead", options={"maxfev": evaluations}).fun)
        bases = path.copy()
        for k, waypoint in waypoints if rng.random() < 0.5 else ():
            solutions = planner.all_solutions(robot, waypoint.pose, reference=path[k])
            bases[k] = solutions[int(rng.integers(len(solutions)))]


def measure(problems: int, starts: int, seconds: float, budget: float) -> dict[str, Any]:
    """Plan problems in a time budget, s, and search each from so many starts for so many seconds."""
    where, robot = machine(), planner.load_robot("ur5e")
    rows = []
    for number in range(problems):
        problem = through_poses(robot, number, POSES[number % len(POSES)], free=REGION)
        plan = planner.plan(replace(problem, optimise="duration", time_budget=budget), "trapezoidal")
        best = [_best_in(problem, seconds, seed) for seed in range(starts)]
        report = plan.optimisation
        assert report is not None  # noqa: S101 - requested
        rows.append({"first": report.first, "last": report.last, "iterates": report.iterates, "searches": best})
    return {"machine": where, "budget": budget, "seconds": seconds, "rows": rows}


def _best_in(problem: planner.PlanningProblem, seconds: float, seed: int) -> float:
    """Return the shortest duration, s, of searches within a processor time, s."""
    end, best = time.process_time() + seconds, UNSOLVED
    for found in durations_by_search(problem, REGION, EVALUATIONS, seed):
        best = min(best, found)
        if time.process_time() > end:
            break
    return best


def print_table(figures: dict[str, Any]) -> None:
    """Print the figures for a person."""
    print(f"time budget {figures['budget']:g} s; searches of {figures['seconds']:g} s of processor time each")
    print(f"{'first, s':>10}{'with it, s':>12}{'best of searches, s':>22}{'ratio':>8}{'of a single one':>18}")
    for row in figures["rows"]:
        best, middle = min(row["searches"]), float(np.median(row["searches"]))
        beside = f"{row['last'] / best:>8.3f}{row['last'] / middle:>18.3f}"
        print(f"{row['first']:>10.3f}{row['last']:>12.3f}{best:>22.3f}{beside}")
    ratios = [row["last"] / min(row["searches"]) for row in figures["rows"]]
    within = sum(ratio <= WITHIN for ratio in ratios)
    print(f"{within} of {len(ratios)} within {WITHIN:g} of the best; the worst {max(ratios):.3f}")
