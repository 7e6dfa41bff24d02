"""Points timed anew: their distances, the limits, and the duration by the plain package toppra."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import toppra
from scipy.interpolate import PPoly

from planner.backends import Cubic, MinEffort, Quintic, Ruckig, Toppra, Trapezoidal
from planner.errors import InvalidProblem, JointPositionLimit, LimitsUnsatisfiable
from planner.limits import Limits
from planner.operations import retime_trajectory
from planner.operations.smoothing import smooth_curve_near
from planner.spatial import FloatArray
from planner.trajectories.polynomials import PiecewisePolynomial
from planner.trajectories.trajectory import Trajectory
from tests.planner.operations.curves import by_scipy, kuka

HOME = np.array([0.0, -1.5, 1.5, 0.0, 0.5, 0.0])
LINE = np.linspace(0.0, 1.0, 1000)[:, None] * [1.0, 0.2, 0.1, 0.0, 0.3, 0.0]


def smooth(count: int, seed: int = 1) -> FloatArray:
    """Return random sines of all joints, with five frequencies."""
    u, random = np.linspace(0.0, 1.0, count)[:, None], np.random.default_rng(seed)
    return HOME + sum(0.15 / k * random.normal(size=6) * np.sin(np.pi * k * u + k) for k in range(1, 6))


def zigzag() -> FloatArray:
    points = np.tile(HOME, (9, 1))
    points[:, 0] += np.linspace(0.0, 1.0, 9)
    points[1::2, 1] += 0.2
    return points


def circle() -> FloatArray:
    angles = np.linspace(0.0, 2.0 * np.pi, 500)[:, None]
    return HOME + np.sin(angles) * [0.3, 0, 0, 0, 0, 0] + (1.0 - np.cos(angles)) * [0, 0.2, 0, 0, 0, 0]


POINTS: dict[str, tuple[Callable[[], FloatArray], float]] = {
    "smooth": (lambda: smooth(400), 1e-3),
    "zigzag": (zigzag, 1e-2),
    "noisy": (lambda: smooth(400) + np.random.default_rng(2).normal(scale=1e-3, size=(400, 6)), 5e-3),
    "repeated": (lambda: np.repeat(smooth(100), 5, axis=0), 1e-3),
    "a line of one joint": (lambda: HOME + np.linspace(0, 1, 300)[:, None] * [0, 0, 0.5, 0, 0, 0], 1e-3),
    "points 1e-12 apart": (lambda: np.sort(np.concatenate([HOME + LINE, HOME + LINE + 1e-12]), axis=0), 1e-3),
    "two points": (lambda: HOME + LINE[[0, -1]], 1e-3),
    "there and back": (lambda: HOME + np.concatenate([LINE, LINE[::-1]]), 1e-2),
    "a circle": (circle, 1e-3),
    "two thousand points": (lambda: smooth(2000, seed=3), 1e-3),
}


def distances(trajectory: Trajectory, points: FloatArray) -> tuple[float, float]:
    """Return the largest distances of points from a trajectory, and of it from their polyline: dense samples."""
    path = by_scipy(trajectory, np.linspace(0.0, trajectory.duration, 1500))

    def from_lines(of: FloatArray, lines: FloatArray) -> float:
        starts, chords = lines[:-1], np.diff(lines, axis=0)
        along = np.einsum("nkj,kj->nk", of[:, None] - starts, chords) / np.maximum((chords**2).sum(axis=1), 1e-300)
        nearest = starts + np.clip(along, 0.0, 1.0)[..., None] * chords
        return float(np.abs(of[:, None] - nearest).max(axis=2).min(axis=1).max())

    return from_lines(points[:: max(1, len(points) // 50)], path), from_lines(path[::30], points)


@pytest.mark.long_table
@pytest.mark.parametrize("name", POINTS)
def test_it_stays_near_the_points_and_within_limits(name: str) -> None:
    made, most = POINTS[name]
    points, robot = made(), kuka()
    done = retime_trajectory(robot, points, Toppra(), max_deviation=most)
    assert done.deviation <= most
    to_points, to_lines = distances(done.trajectory, points)
    assert max(to_points, to_lines) <= done.deviation + 1e-6
    ends = by_scipy(done.trajectory, np.array([0.0, done.trajectory.duration]))
    assert ends == pytest.approx(points[[0, -1]], abs=1e-9)
    times = np.linspace(0.0, done.trajectory.duration, 5000)
    for order, quantity in ((1, "velocity"), (2, "acceleration")):
        assert (np.abs(by_scipy(done.trajectory, times, order)) <= robot.limit(quantity) * (1.0 + 1e-6)).all()
    assert done.warnings == ()


@pytest.mark.parametrize("backend", [Cubic(), Quintic(), Trapezoidal(), Ruckig(), Ruckig("time")], ids=str)
def test_every_back_end_times_them(backend: Any) -> None:
    for name in ("noisy", "two points"):
        made, most = POINTS[name]
        done = retime_trajectory(kuka(), made(), backend, max_deviation=most)
        assert done.certificate.satisfied
        assert max(distances(done.trajectory, made())) <= done.deviation + 1e-6
        [jerk] = [check for check in done.certificate.checks if check.quantity == "jerk"]
        assert jerk.enforced == (backend.guarantees["jerk"] == "hard")


class PlainPath(toppra.interpolator.AbstractGeometricPath):  # type: ignore[misc]
    """A curve of ours with the interface of the package."""

    def __init__(self, curve: PiecewisePolynomial) -> None:
        self.curve = PPoly(curve.coefficients.transpose(2, 0, 1)[::-1], curve.breakpoints)
        self.joints = curve.coefficients.shape[1]

    @property
    def path_interval(self) -> FloatArray:
        """The first and the last parameter."""
        return np.asarray(self.curve.x[[0, -1]])

    @property
    def dof(self) -> int:
        """The number of joints."""
        return int(self.joints)

    def __call__(self, at: Any, order: int = 0) -> FloatArray:
        return np.asarray(self.curve(at, order))


@pytest.mark.parametrize("name", ["smooth", "zigzag", "noisy"])
def test_it_is_as_fast_as_the_plain_package_on_the_same_curve(name: str) -> None:
    made, most = POINTS[name]
    robot = kuka()
    velocity, acceleration = robot.limit("velocity"), robot.limit("acceleration")
    smoothed = smooth_curve_near(made(), velocity, most)
    assert smoothed is not None
    bounds = [
        toppra.constraint.JointVelocityConstraint(np.column_stack([-velocity, velocity])),
        toppra.constraint.JointAccelerationConstraint(np.column_stack([-acceleration, acceleration])),
    ]
    path = PlainPath(smoothed.curve)
    gridpoints = np.linspace(*path.path_interval, 1500)
    algorithm = toppra.algorithm.TOPPRA(bounds, path, gridpoints, parametrizer="ParametrizeConstAccel")
    plain = algorithm.compute_trajectory().duration
    done = retime_trajectory(robot, made(), Toppra(), max_deviation=most)
    assert done.trajectory.duration == pytest.approx(plain, rel=0.02)


def test_a_larger_deviation_is_faster() -> None:
    made, _ = POINTS["noisy"]
    durations = [
        retime_trajectory(kuka(), made(), Ruckig(), max_deviation=most).trajectory.duration for most in (5e-3, 5e-2)
    ]
    assert durations == sorted(durations, reverse=True)


def test_noise_beyond_the_deviation_gets_no_more_intervals_than_pay(monkeypatch: pytest.MonkeyPatch) -> None:
    """2,000 points with noise of three deviations took toppra a minute: 135,000 intervals, then twice as many."""
    points = HOME + LINE[::20] + np.random.default_rng(0).normal(scale=3e-3, size=LINE[::20].shape)
    fine = retime_trajectory(kuka(), points, Toppra())
    monkeypatch.setattr("planner.backends.toppra.intervals.MOST_SPLITTABLE_INTERVALS", 200)
    coarse = retime_trajectory(kuka(), points, Toppra())
    assert len(coarse.trajectory.lengths) < 0.5 * len(fine.trajectory.lengths)
    assert coarse.certificate.satisfied
    assert fine.trajectory.duration <= coarse.trajectory.duration <= 1.1 * fine.trajectory.duration


def test_points_that_do_not_move_are_a_rest() -> None:
    for points in (HOME[None], np.tile(HOME, (5, 1)), HOME + 1e-9 * LINE[::100]):
        done = retime_trajectory(kuka(), points)
        assert done.trajectory.duration <= 0.01
        assert done.deviation <= 1e-8


@pytest.mark.large_only
def test_pairs_of_points_that_are_all_but_one() -> None:
    """The stiffest curves near them exceed the precision of numbers."""
    rng = np.random.default_rng(1)
    points = np.repeat(np.cumsum(0.1 * rng.normal(size=(400, 3)), axis=0), 2, axis=0)
    points[1::2] += 1e-4 * rng.normal(size=(400, 3))
    curve = smooth_curve_near(points, np.ones(3), 0.0025)
    assert curve is not None
    assert curve.deviation <= 0.0025


def test_points_and_options_that_are_refused() -> None:
    for points, message in (
        (np.zeros((3, 2)), "3 x 2 values"),
        (np.zeros(6), "6 values"),
        (np.full((2, 6), np.nan), "must be finite numbers"),
    ):
        with pytest.raises(InvalidProblem, match=message):
            retime_trajectory(kuka(), points)
    with pytest.raises(InvalidProblem, match="greater than 0"):
        retime_trajectory(kuka(), HOME + LINE, max_deviation=0.0)
    with pytest.raises(InvalidProblem, match="rest to rest"):
        retime_trajectory(kuka(), HOME + LINE, Ruckig(initial_velocity=(0.1,) * 6))
    with pytest.raises(InvalidProblem, match="min_effort chooses its own path"):
        retime_trajectory(kuka(), HOME + LINE, MinEffort())
    with pytest.raises(JointPositionLimit, match="joint_a1"):
        retime_trajectory(kuka(), HOME + np.array([[0.0] * 6, [4.0] + [0.0] * 5, [0.0] * 6]))
    with pytest.raises(JointPositionLimit):
        retime_trajectory(kuka(), HOME + LINE * 9.0)
    with pytest.raises(LimitsUnsatisfiable, match="torque"):
        retime_trajectory(kuka(), HOME + LINE, Toppra(), limits=Limits(torque=(1.0,) * 6))
