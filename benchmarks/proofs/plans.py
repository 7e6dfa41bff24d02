"""Plans of every back end whose proofs are written, checked and tampered with."""

from __future__ import annotations

from typing import TYPE_CHECKING

import planner

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np

ROBOTS = ("kuka_kr16_2", "fr3", "ur5e", "date_sorting_arm")
BACK_ENDS = (planner.Cubic(), planner.Quintic(), planner.Trapezoidal(), planner.Ruckig(), planner.Toppra())


def scene() -> planner.Scene:
    """Return a floor, a box and a post."""
    return planner.Scene(
        [
            planner.SceneObject("floor", [planner.HalfSpace([0.0, 0.0, 1.0], -0.6)]),
            planner.SceneObject("box", [planner.Box([0.3, 0.3, 0.2])], planner.Pose([1.1, 0.9, 0.1])),
            planner.SceneObject("post", [planner.Cylinder(0.08, 0.9)], planner.Pose([-1.0, 1.1, 0.2])),
        ],
        margin=0.005,
    )


def problem(robot: planner.Robot, generator: np.random.Generator, waypoints: int) -> planner.PlanningProblem:
    """Return waypoints near each other, half of the time in a scene, with limits of the tool."""
    lower, upper = robot.limit("lower").clip(-2.5, 2.5), robot.limit("upper").clip(-2.5, 2.5)
    start = lower + generator.uniform(0.3, 0.7, robot.dof) * (upper - lower)
    steps = generator.uniform(-0.12, 0.12, (waypoints, robot.dof)) * (upper - lower)
    positions = (start + steps.cumsum(axis=0)).clip(lower, upper)
    limits = planner.Limits(
        tcp_linear_velocity=float(generator.uniform(0.3, 2.0)),
        tcp_angular_velocity=float(generator.uniform(1.0, 6.0)),
        tcp_linear_acceleration=float(generator.uniform(5.0, 40.0)) if generator.random() < 0.5 else None,
    )
    around = scene() if generator.random() < 0.5 else None
    return planner.PlanningProblem(robot, [planner.JointWaypoint(q) for q in positions], limits=limits, scene=around)


def plans(generator: np.random.Generator, count: int) -> Iterator[planner.Plan]:
    """Yield as many random plans as wanted, over all robots and back ends."""
    robots = [planner.load_robot(name) for name in ROBOTS]
    made = tried = 0
    while made < count:
        robot, backend = robots[tried % len(robots)], BACK_ENDS[tried % len(BACK_ENDS)]
        tried += 1
        try:
            plan = planner.plan(problem(robot, generator, int(generator.integers(2, 4))), backend)
        except planner.PlanningError:
            continue
        made += 1
        yield plan
