"""What of a plan is drawn."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from planner.backends.base import BackEnd
from planner.certificate.checks import Certificate
from planner.paths import JointPath
from planner.problems.problem import PlanningProblem, ViaWaypoint
from planner.spatial import FloatArray
from planner.trajectories.trajectory import PlanWarning, Trajectory

DRAWN_SAMPLES = 1000
"""The number of samples that curves are drawn with: about as many as a picture has columns."""

LEAST_PICTURE_PERIOD = 1e-6
"""The least time between two of them, s, for motions that take no time."""


class Planned(Protocol):
    """What of a plan is drawn; a `planner.Plan` has all of it, and pictures lie below plans in the library's layers."""

    @property
    def problem(self) -> PlanningProblem:
        """The request."""

    @property
    def backend(self) -> BackEnd:
        """What put time on the path."""

    @property
    def path(self) -> JointPath:
        """The path of the joints."""

    @property
    def trajectory(self) -> Trajectory:
        """The path with time on it."""

    @property
    def certificate(self) -> Certificate:
        """The check of the trajectory."""

    @property
    def warnings(self) -> tuple[PlanWarning, ...]:
        """What there is to know besides."""


class NamedStop(NamedTuple):
    """A requested waypoint: its row in the path, its name, and its time, s."""

    row: int
    name: str
    arrival: float
    departure: float


def stops_of(plan: Planned) -> list[NamedStop]:
    """List the requested waypoints, without the corners of detours; a waypoint without a name has its number."""
    requested = [row for row, waypoint in enumerate(plan.problem.waypoints) if not isinstance(waypoint, ViaWaypoint)]
    times = plan.trajectory.arrivals, plan.trajectory.departures
    return [
        NamedStop(row, plan.problem.waypoints[row].name or str(index), *(float(column[row]) for column in times))
        for index, row in enumerate(requested)
    ]


def drawn_times(plan: Planned) -> FloatArray:
    """Return the times (N,), s, at which curves are evaluated."""
    return plan.trajectory.sample_times(max(plan.trajectory.duration / DRAWN_SAMPLES, LEAST_PICTURE_PERIOD))
