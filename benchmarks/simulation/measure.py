"""Following errors and torques of random plans in MuJoCo, by back end and controller."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

import planner
from benchmarks.machine import machine, print_machine
from cli.work.terminal import plain_table, terminal

if TYPE_CHECKING:
    from collections.abc import Iterator

ROBOTS = {"ur5e": (0.0, -1.2, 1.8, -0.6, 1.6, 0.3), "fr3": (0.0, -0.4, 0.0, -2.0, 0.0, 1.9, 0.8)}
"""Robots with masses and torque limits, and the positions around which their random waypoints lie."""

BACK_ENDS: dict[str, planner.BackEnd] = {
    "cubic": planner.Cubic(),
    "quintic": planner.Quintic(),
    "trapezoidal": planner.Trapezoidal(),
    "ruckig": planner.Ruckig(),
    "toppra": planner.Toppra(),
    "toppra, C2": planner.Toppra(jerk_limited=True),
    "min_effort": planner.MinEffort(),
}

WEAKER = 0.4
"""Share of the torque limits that the robots have here: with their own, torques seldom bind."""

TORQUE_SCALES = (1.0, 0.9)
"""Shares of these limits that the plans may use; the rest is left to the controller."""

CONTROLLERS = {
    "torque": planner.Servo(),
    "torque, +5 % mass": planner.Servo(mass_error=0.05),
    "gravity": planner.Servo(feed_forward="gravity"),
}


def measure(count: int) -> dict[str, Any]:
    """Simulate as many plans as wanted, the same waypoints by all back ends, under each controller."""
    place, rows = machine(), []
    problems = list(_problems(-(-count // (len(BACK_ENDS) * len(TORQUE_SCALES)))))
    for (name, backend), scale in product(BACK_ENDS.items(), TORQUE_SCALES):
        limits = planner.Limits(torque_scale=scale)
        plans = [_plan(replace(problem, limits=limits), backend) for problem in problems]
        for controller, servo in CONTROLLERS.items():
            runs = [planner.simulate(plan, servo) for plan in plans if plan is not None]
            errors = [float(np.degrees(run.following_error.max())) for run in runs]
            ratios = [float(np.nanmax(run.torque_ratio)) for run in runs]
            row = {"back end": name, "torque_scale": scale, "controller": controller, "plans": len(runs)}
            row |= {"following error, deg": _spread(errors), "torque ratio": _spread(ratios)}
            row["cut"] = float(np.mean([run.limited.any() for run in runs])) if runs else np.nan
            rows.append(row)
    return {"machine": place, "rows": rows}


def _problems(count: int) -> Iterator[planner.PlanningProblem]:
    """Yield lists of waypoints for robots with weaker motors, alternating."""
    rng = np.random.default_rng(4)
    robots = [planner.load_robot(name) for name in ROBOTS]
    weak = [
        robot.derived(
            id=robot.id,
            limits={
                name: {"torque": WEAKER * own}
                for name, own in zip(robot.joint_names, robot.limit("torque"), strict=True)
            },
        )
        for robot in robots
    ]
    for k in range(count):
        robot, home = weak[k % len(weak)], list(ROBOTS.values())[k % len(weak)]
        positions = np.array(home) + rng.uniform(-0.5, 0.5, (int(rng.integers(2, 7)), len(home)))
        yield planner.PlanningProblem(robot, [planner.JointWaypoint(position) for position in positions])


def _plan(problem: planner.PlanningProblem, backend: planner.BackEnd) -> planner.Plan | None:
    try:
        return planner.plan(problem, backend)
    except planner.PlanningError:
        return None


def _spread(values: list[float]) -> tuple[float, float, float]:
    """Return the median, the 99th percentile and the largest value."""
    if not values:
        return np.nan, np.nan, np.nan
    return float(np.median(values)), float(np.percentile(values, 99)), float(np.max(values))


def print_table(figures: dict[str, Any]) -> None:
    """Print the figures for a person: median, 99th percentile and largest value."""
    console = terminal()
    print_machine(console, figures["machine"])
    columns = ("plans", "error, deg", "torque ratio", "cut")
    table = plain_table("back end", "scale", "controller", *columns, right=columns)
    for row in figures["rows"]:
        error, ratio = (
            " / ".join(f"{value:.3g}" for value in row[name]) for name in ("following error, deg", "torque ratio")
        )
        names = (row["back end"], f"{row['torque_scale']:g}", row["controller"], str(row["plans"]))
        table.add_row(*names, error, ratio, f"{row['cut']:.0%}")
    console.print(table)
    console.print("median / 99th percentile / largest; cut: plans in which the robot's torque limit cut a torque")
