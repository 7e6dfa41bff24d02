"""Limits of mechanical power: every back end against Pinocchio at dense samples, and the paces that keep them."""

from __future__ import annotations

from itertools import product

import numpy as np
import pinocchio as pin
import pytest

from planner import (
    InvalidProblem,
    JointWaypoint,
    Limits,
    LinearMotion,
    MissingDynamics,
    PlanningProblem,
    Pose,
    PoseWaypoint,
    Robot,
    StopTransition,
    ThroughTransition,
    forward_kinematics,
    load_robot,
    plan,
)
from planner.backends import BACKENDS
from planner.constraints.excess import first_excess
from planner.plans.result import Plan
from planner.robots.payload import Payload
from planner.spatial import FloatArray
from tests.sizes import NAME, diagonal

SAMPLES = {"quick": 20_000, "large": 100_000, "soak": 100_000}[NAME]
"""Samples of each plan."""

TOTAL = 40.0
"""Limit of the total power, W."""

LIMITS = (Limits(power=(30.0, 40.0, 30.0, 10.0, 8.0, 3.0)), Limits(total_power=TOTAL))
"""Limits that bind on a UR5: of each joint, and of all together."""

LOAD = Payload(2.0, (0.02, 0.0, 0.08))
"""The payload of the UR5."""


def powers(made: Plan, robot: Robot) -> FloatArray:
    """Return the powers (N, joints), W, by Pinocchio, at dense times and at both ends of each piece."""
    trajectory = made.trajectory
    inside = trajectory.breakpoints[:-1, None] + trajectory.lengths[:, None] * np.array([1e-6, 1.0 - 1e-6])
    times = np.sort(np.concatenate([np.linspace(0.0, trajectory.duration, SAMPLES), inside.ravel()]))
    states = trajectory.evaluate(times, [0, 1, 2])
    data = robot.model.createData()
    return np.array([pin.rnea(robot.model, data, *state) * state[1] for state in zip(*states, strict=True)])


def through(seed: int) -> list[JointWaypoint]:
    """Return random joint positions, the inner ones passed without stopping."""
    positions = np.random.default_rng(seed).uniform(-1.2, 1.2, (4, 6))
    kinds = (StopTransition(), ThroughTransition(), ThroughTransition(), StopTransition())
    return [JointWaypoint(tuple(q.tolist()), transition=t) for q, t in zip(positions, kinds, strict=True)]


def lifting() -> list[JointWaypoint | PoseWaypoint]:
    """Return a line straight up and down again.

    Lifting needs most power, and the arm brakes on the way down.
    """
    robot = load_robot("ur5e")
    start = (0.3, -0.9, 1.9, -1.0, 0.3, 0.0)
    pose = forward_kinematics(robot, start)
    x, y, z = pose.position
    up = Pose((x, y, z + 0.3), pose.rotation)
    return [JointWaypoint(start), PoseWaypoint(up, motion=LinearMotion()), PoseWaypoint(pose, motion=LinearMotion())]


@pytest.mark.long_table
@pytest.mark.parametrize(("kind", "moved"), diagonal(BACKENDS, product([through(3), lifting()], LIMITS)))
def test_every_back_end_keeps_limits_of_power(kind: str, moved: tuple[list[JointWaypoint], Limits]) -> None:
    waypoints, limits = moved
    robot = load_robot("ur5e")
    made = plan(PlanningProblem(robot, waypoints, limits=limits, payload=LOAD), BACKENDS[kind]())
    dense = powers(made, robot.with_payload(LOAD))
    used = np.abs(dense) / limits.power if limits.power else np.abs(dense.sum(axis=1, keepdims=True)) / TOTAL
    (check,) = (check for check in made.certificate.checks if check.quantity in ("power", "total_power"))
    assert check.method == "bounded" and check.satisfied and check.ratio is not None and check.lower is not None
    assert used.max() <= check.ratio * (1.0 + 1e-10) <= 1.0 + 1e-8
    assert check.ratio <= used.max() * (1.0 + 1e-3) and check.lower <= check.peak <= check.lower * (1.0 + 1e-5)
    assert check.joint == (robot.joint_names[int(used.max(axis=0).argmax())] if limits.power else None)
    free = plan(PlanningProblem(robot, waypoints, payload=LOAD), BACKENDS[kind]())
    assert free.trajectory.duration < made.trajectory.duration, "the limit binds"


def test_a_time_scaling_along_the_path_is_faster_than_a_uniform_stretch() -> None:
    problem = PlanningProblem(load_robot("ur5e"), lifting(), limits=Limits(total_power=TOTAL), payload=LOAD)
    along, stretched = (plan(problem, kind).trajectory.duration for kind in ("ruckig", "quintic"))
    assert along < 0.75 * stretched


@pytest.mark.long_table
@pytest.mark.parametrize("factor", [1.05, 1.7, 6.0])
@pytest.mark.parametrize("kind", ["quintic", "ruckig", "toppra"])
def test_longer_durations_keep_limits_of_power_as_the_shortest_do(kind: str, factor: float) -> None:
    robot = load_robot("ur5e")
    problem = PlanningProblem(robot, lifting(), limits=Limits(total_power=TOTAL), payload=LOAD)
    fastest = plan(problem, kind).trajectory.duration
    longer = PlanningProblem(
        robot, lifting(), limits=Limits(total_power=TOTAL), payload=LOAD, duration=factor * fastest
    )
    assert np.abs(powers(plan(longer, kind), robot.with_payload(LOAD)).sum(axis=1)).max() <= TOTAL * (1.0 + 1e-8)


def test_power_is_not_monotone_in_the_duration_and_the_factor_knows() -> None:
    # 2 x - x^3 has its largest value, about 1.089, at x = 0.816; the limit 1 is exceeded before that.
    found = first_excess(np.array([[0.0], [2.0], [0.0], [-1.0]]), np.array([1.0]))
    assert found[0] == pytest.approx((np.sqrt(5.0) - 1.0) / 2.0, rel=1e-12)
    # Below the limit 1.1 it passes this hump; minus the limit is then reached further on.
    further = first_excess(np.array([[0.0], [2.0], [0.0], [-1.0]]), np.array([1.1]))[0]
    assert 2.0 * further - further**3 == pytest.approx(-1.1, rel=1e-12)


def test_the_first_excess_of_random_cubics_is_that_of_dense_samples() -> None:
    rng = np.random.default_rng(27)
    coefficients = rng.normal(size=(4, 3000)) * 10.0 ** rng.uniform(-3.0, 3.0, (4, 3000))
    coefficients[rng.integers(0, 4, 3000), np.arange(3000)] = 0.0
    coefficients[1:, :50] = 0.0
    limits = np.abs(coefficients[0]) + 10.0 ** rng.uniform(-2.0, 2.0, 3000)
    found = first_excess(coefficients, limits)
    bounded = np.isfinite(found)
    assert bounded.any() and not bounded.all()

    def used(x: FloatArray) -> FloatArray:
        return np.abs(np.polynomial.polynomial.polyval(x, coefficients, tensor=False)) / limits

    np.testing.assert_allclose(used(np.where(bounded, found, 0.0))[bounded], 1.0, rtol=1e-9)
    for share in np.linspace(0.0, 1.0 - 1e-9, 2001):
        assert (used(share * np.where(bounded, found, 1.0)) <= 1.0 + 1e-9).all()


def test_a_limit_of_power_that_cannot_be_checked_is_refused() -> None:
    with pytest.raises(MissingDynamics, match="power limits cannot be checked"):
        plan(PlanningProblem(load_robot("three_dof_arm"), [(0.1, 0.1, 0.1), (0.2, 0.3, 0.1)], Limits(total_power=1.0)))


@pytest.mark.parametrize("limits", [Limits(power=(1.0,)), Limits(power=(0.0,) * 6), Limits(total_power=-1.0)])
def test_limits_of_power_that_make_no_sense_are_refused(limits: Limits) -> None:
    with pytest.raises(InvalidProblem, match="power"):
        plan(PlanningProblem(load_robot("ur5e"), [(0.1,) * 6, (0.2,) * 6], limits))
