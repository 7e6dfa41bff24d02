"""The fastest stop on the path of a trajectory, against Ruckig on a straight line, and dense samples of the path."""

from __future__ import annotations

import numpy as np
import pytest

from planner.backends import Ruckig
from planner.errors import InvalidProblem, LimitsUnsatisfiable
from planner.operations import slice_trajectory, stop_joints, stop_on_path
from planner.planning import plan
from planner.problem import JointWaypoint, PlanningProblem
from planner.spatial import FloatArray
from planner.trajectory import Trajectory
from tests.planner.operations.curves import by_scipy, fastest_by_ruckig, inner_times, kuka, planned


def distance_from(trajectory: Trajectory, positions: FloatArray) -> float:
    """The largest distance of joint positions (N, joints) from the path of a trajectory, by dense chords."""
    path = by_scipy(trajectory, np.linspace(0.0, trajectory.duration, 4000))
    starts, chords = path[:-1], np.diff(path, axis=0)
    farthest = 0.0
    for position in positions:
        shares = ((position - starts) * chords).sum(axis=1) / np.maximum((chords**2).sum(axis=1), 1e-30)
        nearest = starts + np.clip(shares, 0.0, 1.0)[:, None] * chords
        farthest = max(farthest, float(np.linalg.norm(nearest - position, axis=1).min()))
    return farthest


@pytest.mark.parametrize(("kind", "share"), [("quintic", 0.15), ("cubic", 0.15)])
def test_the_stop_keeps_to_the_path_and_to_all_limits(kind: str, share: float) -> None:
    given = planned(kind)
    start = share * given.duration
    stop = stop_on_path(kuka(), given, start)
    assert stop.trajectory.duration < 0.5 * (given.duration - start)
    (position, velocity, acceleration), begin = given.evaluate(start), stop.initial
    assert (begin.position, begin.velocity) == (pytest.approx(position), pytest.approx(velocity, abs=1e-6))
    if kind == "quintic":
        assert begin.acceleration == pytest.approx(acceleration, abs=1e-5)
    assert stop.final.velocity == pytest.approx(np.zeros(6), abs=1e-6)
    times = inner_times(stop.trajectory, 200)
    assert distance_from(given, by_scipy(stop.trajectory, times)) < 1e-5
    for order, quantity in enumerate(("velocity", "acceleration", "jerk"), 1):
        if quantity != "jerk" or kind == "quintic":
            assert (np.abs(by_scipy(stop.trajectory, times, order)) <= kuka().limit(quantity) * (1 + 1e-6)).all()
    if kind == "quintic":
        assert stop.trajectory.duration >= stop_joints(kuka(), begin).trajectory.duration


def test_on_a_straight_line_at_full_speed_it_is_as_fast_as_ruckig() -> None:
    ends = (0.0, -1.5, 1.5, 0.0, 0.5, 0.0), (2.5, -1.5, 1.5, 0.0, 0.5, 0.0)
    given = plan(PlanningProblem(kuka(), tuple(map(JointWaypoint, ends))), Ruckig()).trajectory
    stop = stop_on_path(kuka(), given, 0.45 * given.duration)
    expected = max(fastest_by_ruckig(kuka(), stop.initial))
    assert expected <= stop.trajectory.duration * (1 + 1e-9)
    assert stop.trajectory.duration <= 1.04 * expected


def test_where_no_faster_stop_is_found_the_end_is_the_stop() -> None:
    given = planned("trapezoidal")
    stop = stop_on_path(kuka(), given, 0.97 * given.duration)
    assert [warning.code for warning in stop.warnings][-1] == "stops_at_the_end"
    assert stop.trajectory.duration == pytest.approx(0.03 * given.duration)


def test_stops_that_are_refused() -> None:
    given = planned("cubic")
    for time in (-0.1, given.duration, np.nan):
        with pytest.raises(InvalidProblem, match="not within the trajectory"):
            stop_on_path(kuka(), given, time)
    short = slice_trajectory(kuka(), planned("quintic"), 0.2, 0.25).trajectory
    with pytest.raises(LimitsUnsatisfiable, match="ends in motion"):
        stop_on_path(kuka(), short, 0.01)
