"""Evaluation and scaling of trajectories, against scipy's piecewise polynomials."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import PPoly

from planner.backends import BACKENDS
from planner.planning import plan
from planner.trajectories.trajectory import PlanWarning, Trajectory
from tests.planner.problems_of_tests import backend_of, problem_of

ORDERS = range(5)


def trajectory_of(pieces: int, joints: int, order: int, seed: int, shortest: float = 1e-6) -> Trajectory:
    """Draw pieces, some very short; they need not meet at breakpoints."""
    rng = np.random.default_rng(seed)
    lengths = np.exp(rng.uniform(np.log(shortest), np.log(3.0), pieces))
    times = np.concatenate([[0.0], np.cumsum(lengths)])[:: max(pieces // 3, 1)]
    return Trajectory(
        lengths=lengths,
        coefficients=rng.normal(size=(pieces, joints, order)),
        segments=np.zeros(pieces, dtype=int),
        arrivals=times,
        departures=times,
        warnings=(PlanWarning("made", "by chance"),),
    )


def in_scipy(trajectory: Trajectory) -> PPoly:
    """Return the same pieces in scipy's form: descending powers of the local time, (order, pieces, joints)."""
    return PPoly(trajectory.coefficients.transpose(2, 0, 1)[::-1], trajectory.breakpoints)


RANDOM = [
    trajectory_of(pieces, joints, order, seed)
    for seed, (pieces, joints, order) in enumerate(
        [(1, 1, 1), (1, 6, 4), (2, 1, 6), (7, 3, 6), (200, 7, 3), (50, 6, 7)]
    )
]


def times_of(trajectory: Trajectory) -> np.ndarray:
    inside = np.random.default_rng(1).uniform(0.0, trajectory.duration, 500)
    return np.concatenate([trajectory.breakpoints, inside])


@pytest.mark.long_table
@pytest.mark.parametrize("trajectory", RANDOM)
def test_evaluates_as_scipy_does(trajectory: Trajectory) -> None:
    times, reference = times_of(trajectory), in_scipy(trajectory)
    for order, values in zip(ORDERS, trajectory.evaluate(times, ORDERS), strict=True):
        assert values == pytest.approx(reference(times, order), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("trajectory", RANDOM)
def test_one_time_is_a_row_of_many(trajectory: Trajectory) -> None:
    times = times_of(trajectory)[:20]
    many = trajectory.evaluate(times)
    for row, time in enumerate(times):
        for one, all_rows in zip(trajectory.evaluate(time), many, strict=True):
            assert one.shape == (trajectory.coefficients.shape[1],)
            assert (one == all_rows[row]).all()


@pytest.mark.long_table
@pytest.mark.parametrize("kind", ["cubic", "quintic", "trapezoidal", "ruckig", "toppra"])
def test_plans_evaluate_as_scipy_does(kind: str) -> None:
    trajectory = plan(problem_of("kuka_kr16_2", 4, 5), backend_of(kind)).trajectory
    times, reference = trajectory.sample_times(0.01), in_scipy(trajectory)
    for order, values in enumerate(trajectory.evaluate(times)):
        assert values == pytest.approx(reference(times, order), rel=1e-9, abs=1e-9)


def test_kinds_of_times() -> None:
    trajectory = trajectory_of(5, 3, 4, 0)
    for scalar in (0, 0.0, np.float64(0.0), np.array(0.0)):
        assert [values.shape for values in trajectory.evaluate(scalar)] == [(3,)] * 3
    for row in ([0.0, 0.1], (0.0, 0.1), np.array([0.0, 0.1])):
        assert [values.shape for values in trajectory.evaluate(row)] == [(2, 3)] * 3
    assert [values.shape for values in trajectory.evaluate([])] == [(0, 3)] * 3
    assert [values.shape for values in trajectory.evaluate(0.1, [3])] == [(3,)]


@pytest.mark.parametrize("beyond", [-np.inf, -1.0, -1e-6, "duration + 1e-6", "duration + 1", np.inf, np.nan])
def test_outside_of_the_trajectory_is_an_error(beyond: float | str) -> None:
    trajectory = trajectory_of(5, 3, 4, 0)
    time = trajectory.duration + float(beyond.split("+")[1]) if isinstance(beyond, str) else beyond
    message = rf"time {time} s is outside of the trajectory's \[0, {trajectory.duration}\] s".replace("+", r"\+")
    for times in (time, [0.0, time], [time, 0.1]):
        with pytest.raises(ValueError, match=message):
            trajectory.evaluate(times)


def test_rounding_is_not_outside() -> None:
    trajectory = trajectory_of(5, 3, 4, 0)
    edges = np.array([0.0, trajectory.duration])
    beyond = np.array([-1e-12, 1e-12]) * trajectory.duration + edges
    for at_the_edge, past_it in zip(trajectory.evaluate(edges), trajectory.evaluate(beyond), strict=True):
        assert (at_the_edge == past_it).all()


def test_a_table_of_times_and_a_negative_order_are_errors() -> None:
    trajectory = trajectory_of(5, 3, 4, 0)
    with pytest.raises(ValueError, match=r"shape \(2, 2\)"):
        trajectory.evaluate(np.zeros((2, 2)))
    with pytest.raises(ValueError, match="orders"):
        trajectory.evaluate(0.0, [-1])


@pytest.mark.parametrize("factor", [1e-3, 0.5, 1.0, 1.7, 1e3])
@pytest.mark.parametrize("trajectory", RANDOM)
def test_scaling(trajectory: Trajectory, factor: float) -> None:
    """The path is equal, and each derivative is divided by a power of the factor, by scipy on the first trajectory."""
    scaled, reference = trajectory.scaled(factor), in_scipy(trajectory)
    assert isinstance(scaled, Trajectory)
    assert scaled.duration == pytest.approx(factor * trajectory.duration, rel=1e-12)
    assert scaled.arrivals == pytest.approx(factor * trajectory.arrivals, rel=1e-12)
    assert scaled.departures == pytest.approx(factor * trajectory.departures, rel=1e-12)
    assert (scaled.segments == trajectory.segments).all()
    assert scaled.warnings == trajectory.warnings
    times = (trajectory.breakpoints[:-1] + trajectory.breakpoints[1:]) / 2.0
    for order, values in zip(ORDERS, scaled.evaluate(times * factor, ORDERS), strict=True):
        expected = reference(times, order) / factor**order
        assert values == pytest.approx(expected, rel=1e-7, abs=1e-7 / factor**order)


@pytest.mark.parametrize("factor", [0.0, -1.0, np.nan, np.inf])
def test_a_factor_that_is_no_slowdown(factor: float) -> None:
    with pytest.raises(ValueError, match="scaled"):
        trajectory_of(2, 1, 3, 0).scaled(factor)


def test_every_sample_of_a_plan_can_be_evaluated() -> None:
    for kind in BACKENDS.keys() - {"min_effort"}:
        trajectory = plan(problem_of("ngv_refuelling_arm", 3, 4), backend_of(kind)).trajectory
        for period in (1e-3, 0.01, 0.0333, trajectory.duration / 7.0):
            assert trajectory.sample_times(period)[-1] == trajectory.duration
            trajectory.evaluate(trajectory.sample_times(period), [0])
            trajectory.evaluate(np.cumsum(np.full(round(trajectory.duration / 1e-3) - 1, 1e-3)), [0])


@pytest.mark.parametrize("trajectory", RANDOM, ids=repr)
def test_a_trajectory_becomes_a_polynomial_of_scipy(trajectory: Trajectory) -> None:
    times = np.linspace(0.0, trajectory.duration, 50)
    polynomial = trajectory.to_ppoly()
    for order in range(3):
        assert polynomial(times, order) == pytest.approx(trajectory(times, order), rel=1e-9, abs=1e-9)
        assert trajectory(times[7], order) == pytest.approx(trajectory.evaluate(times, [order])[0][7])
    assert polynomial.x[-1] == trajectory.duration


def test_pieces_of_no_length_are_left_out_of_polynomials_of_scipy() -> None:
    whole = trajectory_of(3, 2, 4, 0)
    lengths = np.array([0.5, 0.0, 0.25])
    made = Trajectory(lengths, whole.coefficients, whole.segments, whole.arrivals, whole.departures)
    assert made.to_ppoly().c.shape == (4, 2, 2)
    assert made.to_ppoly()(0.6) == pytest.approx(made(0.6))
