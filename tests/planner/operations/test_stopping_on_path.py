"""The fastest stop on the path of a trajectory, against Ruckig on a straight line, and dense samples of the path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ruckig

from planner.backends import BackEnd, Quintic, Ruckig, Toppra
from planner.errors import InvalidProblem, LimitsUnsatisfiable
from planner.kinematics.forward import tool_pose
from planner.limits import Limits
from planner.operations import JointState, slice_trajectory, stop_joints, stop_on_path, stopping_on_path
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.spatial import FloatArray
from planner.trajectories.trajectory import Trajectory
from tests.planner.operations.curves import by_scipy, inner_times, kuka, planned
from tests.planner.problems_of_tests import problem_of
from tests.planner.tool_problems import CORNER


def distance_from(trajectory: Trajectory, positions: FloatArray) -> float:
    """Return the largest distance of joint positions (N, joints) from the path of a trajectory, by dense chords."""
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


LINE = (0.0, -1.5, 1.5, 0.0, 0.5, 0.0), (2.5, -1.2, 1.9, 0.1, 0.5, -0.4)


def least_on_line(state: JointState, share: float) -> float:
    """Return the least time of a stop on the line by Ruckig's velocity interface, with a fraction of the limits."""
    speed = float(np.linalg.norm(state.velocity))
    direction = np.maximum(np.abs(state.velocity / speed), 1e-12)
    requested, found = ruckig.InputParameter(1), ruckig.Trajectory(1)
    requested.control_interface = ruckig.ControlInterface.Velocity
    requested.current_velocity = [speed]
    requested.current_acceleration = [float(state.acceleration @ state.velocity) / speed]
    requested.target_velocity = requested.target_acceleration = [0.0]
    requested.max_acceleration, requested.max_jerk = (
        [float((share * kuka().limit(quantity) / direction).min())] for quantity in ("acceleration", "jerk")
    )
    ruckig.Ruckig(1).calculate(requested, found)
    return float(found.duration)


@pytest.mark.parametrize(("share", "at"), [(1.0, 0.02), (1.0, 0.45), (1.0, 0.7), (0.5, 0.1), (0.5, 0.45)])
@pytest.mark.parametrize(
    "backend", [Ruckig(), Quintic(), Toppra(jerk_limited=True)], ids=["ruckig", "quintic", "toppra"]
)
def test_on_a_straight_line_it_is_as_fast_as_ruckig(backend: BackEnd, share: float, at: float) -> None:
    """Half of the acceleration and jerk limits are tried too, where the state at the start of the stop keeps them."""
    given = plan(PlanningProblem(kuka(), tuple(map(JointWaypoint, LINE)), Limits(acceleration_scale=0.4)), backend)
    limits = Limits(acceleration=tuple(share * kuka().limit("acceleration")), jerk=tuple(share * kuka().limit("jerk")))
    time = at * given.trajectory.duration
    stop = stop_on_path(kuka(), given.trajectory, time, limits=limits)
    assert stop.trajectory.duration == pytest.approx(least_on_line(stop.initial, share), rel=1e-6)
    (way,) = stop.trajectory.evaluate(np.linspace(0.0, stop.trajectory.duration, 200), [0])
    since, direction = way - np.array(LINE[0]), np.diff(LINE, axis=0)[0]
    along = since @ direction / (direction @ direction)
    assert np.abs(since - along[:, None] * direction).max() < 1e-9
    assert (np.diff(along) >= -1e-12).all()


@pytest.mark.parametrize("at", [0.02, 0.3, 0.45])
@pytest.mark.parametrize("backend", [Quintic(), Toppra(jerk_limited=True)], ids=["quintic", "toppra"])
def test_the_search_for_any_curve_is_nearly_as_fast_on_a_straight_line(
    backend: BackEnd, at: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The difference is within 3 %; a search by linear programs was slower by up to 16 %."""
    monkeypatch.setattr(stopping_on_path, "stop_on_line", lambda *_arguments, **_options: None)
    given = plan(PlanningProblem(kuka(), tuple(map(JointWaypoint, LINE)), Limits(acceleration_scale=0.4)), backend)
    stop = stop_on_path(kuka(), given.trajectory, at * given.trajectory.duration)
    assert stop.certificate.satisfied
    least = least_on_line(stop.initial, 1.0)
    assert least * (1.0 - 1e-6) <= stop.trajectory.duration <= 1.03 * least


@pytest.mark.long_table
@pytest.mark.parametrize("share", [0.1, 0.3, 0.5])
@pytest.mark.parametrize("backend", [Toppra(), Toppra(jerk_limited=True)], ids=["C1", "C2"])
def test_a_stop_is_found_where_the_trajectory_uses_all_of_its_limits(backend: BackEnd, share: float) -> None:
    """The trajectory turns a corner in the least time; five of these six stops were only found at its end."""
    given = plan(PlanningProblem(kuka(), CORNER), backend).trajectory
    stop = stop_on_path(kuka(), given, share * given.duration)
    assert stop.certificate.satisfied
    assert stop.trajectory.duration < 0.6 * (1.0 - share) * given.duration
    assert distance_from(given, by_scipy(stop.trajectory, inner_times(stop.trajectory, 100))) < 1e-5


def test_where_no_faster_stop_is_found_the_end_is_the_stop() -> None:
    """Along this curve some joint uses all of its limit at every instant."""
    given = plan(PlanningProblem(kuka(), CORNER), Toppra()).trajectory
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
    with pytest.raises(LimitsUnsatisfiable, match="no enforced limit bounds the deceleration"):
        stop_on_path(kuka(), planned("quintic"), 0.2, enforced=["position", "tcp_linear_velocity"])


@pytest.mark.parametrize("kind", ["quintic", "toppra"])
def test_limits_of_the_tools_acceleration_are_kept_by_a_stop_far_before_the_end(kind: str) -> None:
    """Such stops were found only at the trajectory's end: with a limit of the tool's acceleration after up to 18 s."""
    limits = Limits(tcp_linear_acceleration=1.5, tcp_centripetal_acceleration=1.0)
    problem = replace(problem_of("kuka_kr16_l6_2", 0, 4, 0.5), limits=limits)
    given = plan(problem, Quintic() if kind == "quintic" else Toppra(jerk_limited=True)).trajectory
    for share in (0.2, 0.5):
        stop = stop_on_path(kuka(), given, share * given.duration, limits=limits)
        assert stop.certificate.satisfied
        assert stop.trajectory.duration < 1.0 < 0.5 * given.duration
        times, step = inner_times(stop.trajectory, 200), 1e-4
        times = times[(times > step) & (times < stop.trajectory.duration - step)]
        points = [tool_positions(by_scipy(stop.trajectory, times + shift)) for shift in (-step, 0.0, step)]
        accelerations = (points[0] - 2.0 * points[1] + points[2]) / step**2
        assert np.linalg.norm(accelerations, axis=1).max() <= 1.5 * (1.0 + 1e-2)


def tool_positions(positions: FloatArray) -> FloatArray:
    return np.array([tool_pose(kuka(), position).position for position in positions])
