"""The report of an optimisation of a plan's duration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from planner.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class Optimisation:
    """The gain of an optimisation of the duration within the open coordinates of a request.

    Attributes:
        first: The duration without the optimisation, s.
        last: The duration of the plan, s; no larger.
        iterates: The number of other trajectories that were timed. The plan is the shortest one that was certified.
        moved: The joint positions (joints,), rad or m, of waypoints that moved, by their indices in the request.
        radii: The radii of blends that became smaller, m, by the indices of their waypoints in the request.

    Examples:
        >>> import planner
        >>> fr3 = planner.load_robot("fr3")
        >>> start, end = [-0.5, 0.3, -0.2, -2.2, 0.1, 2.4, 0.6], [1.0, 0.4, -0.3, -1.4, 0.3, 1.9, 1.2]
        >>> pick = planner.Pose([0.4, -0.3, 0.4], [[1, 0, 0], [0, -1, 0], [0, 0, -1]])
        >>> problem = planner.PlanningProblem(fr3, [start, pick, end], optimise="duration", optimise_iterates=20)
        >>> report = planner.plan(problem, "ruckig").optimisation
        >>> print(f"{report.first:.2f} s, {report.last:.2f} s")  # the elbow moved at the pose
        1.50 s, 1.47 s
        >>> isinstance(report, planner.Optimisation)
        True
    """

    first: float
    last: float
    iterates: int
    moved: Mapping[int, FloatArray]
    radii: Mapping[int, float]
