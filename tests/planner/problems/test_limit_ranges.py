"""Limits that differ by direction: checked against dense samples, closed forms and a linear program."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import linprog
from scipy.sparse import coo_matrix

from planner.backends import BACKENDS, BackEnd, Quintic, Ruckig, Toppra, Trapezoidal
from planner.errors import InvalidProblem, LimitsUnsatisfiable
from planner.limits import Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.moves import CartesianMove
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, RelativeWaypoint
from planner.problems.transitions import ThroughTransition
from planner.robots import load_robot
from planner.spatial import FloatArray

ROBOT = load_robot("kuka_kr16_2")
START = (0.3, -1.2, 1.4, 0.2, 0.6, 0.1)
VELOCITY = tuple((-0.7 * v, 0.4 * v) for v in ROBOT.limit("velocity"))
ACCELERATION = tuple((-0.3 * a, 0.8 * a) for a in ROBOT.limit("acceleration"))
RANGES = Limits(velocity_range=VELOCITY, acceleration_range=ACCELERATION)
TRIP = [
    JointWaypoint(START),
    JointWaypoint((0.8, -1.0, 1.1, 0.5, 0.4, -0.3), transition=ThroughTransition()),
    JointWaypoint((0.2, -0.7, 1.3, 0.1, 0.8, 0.2)),
    JointWaypoint(START),
]
ALL: list[BackEnd] = [
    *(BACKENDS[kind]() for kind in sorted(BACKENDS) if kind != "min_effort"),
    Toppra(jerk_limited=True),
]


def sampled(result: Plan, count: int = 4000) -> list[FloatArray]:
    return result.trajectory.evaluate(np.linspace(0.0, result.trajectory.duration, count), [0, 1, 2])


def shares(values: FloatArray, ranges: tuple[tuple[float, float], ...]) -> FloatArray:
    lower, upper = np.array(ranges).T
    return np.maximum(values / lower, values / upper)


@pytest.mark.parametrize("backend", ALL, ids=repr)
def test_samples_are_within_the_ranges_and_one_limit_is_reached(backend: BackEnd) -> None:
    result = plan(PlanningProblem(ROBOT, TRIP, RANGES), backend)
    _, velocity, acceleration = sampled(result)
    used = {"velocity": shares(velocity, VELOCITY), "acceleration": shares(acceleration, ACCELERATION)}
    for check in result.certificate.checks:
        if check.quantity in used:
            most = used[check.quantity].max()
            assert most <= 1.0 + 1e-9
            assert check.ratio == pytest.approx(most, rel=0.02)
    assert max(most.max() for most in used.values()) > 0.97


@pytest.mark.parametrize("backend", [Trapezoidal(), Toppra()], ids=repr)
@pytest.mark.parametrize("travel", [0.05, 1.0, -0.05, -1.0])
def test_one_joint_takes_the_time_of_the_closed_form(backend: BackEnd, travel: float) -> None:
    end = (START[0] + travel, *START[1:])
    duration = plan(PlanningProblem(ROBOT, [TRIP[0], JointWaypoint(end)], RANGES), backend).trajectory.duration
    (back, onward), (brake, gain) = VELOCITY[0], ACCELERATION[0]
    speed, gain, brake = (onward, gain, -brake) if travel > 0.0 else (-back, -brake, gain)
    ramps = (1.0 / gain + 1.0 / brake) / 2.0
    speed = min(speed, np.sqrt(abs(travel) / ramps))
    assert duration == pytest.approx(abs(travel) / speed + speed * ramps, rel=1e-6)


@pytest.mark.parametrize("backend", [Quintic(), Ruckig()], ids=repr)
def test_others_heed_the_direction_of_velocities(backend: BackEnd) -> None:
    """Over a long distance, the velocity sets the duration."""
    there, back = ([JointWaypoint((a, *START[1:])) for a in ends] for ends in ((-2.5, 2.5), (2.5, -2.5)))
    times = [plan(PlanningProblem(ROBOT, way, RANGES), backend).trajectory.duration for way in (there, back)]
    assert 1.4 < times[0] / times[1] < 0.7 / 0.4 + 1e-6


def least_time(result: Plan, torque: tuple[tuple[float, float], ...] | None, count: int = 400) -> float:
    """Compute the least duration of the group's curve by a linear program.

    The largest x = s'^2 everywhere, u = s'' constant between gridpoints.
    """
    (group,) = result.path.every_group
    s = np.linspace(0.0, group.curve.breakpoints[-1], count + 1)
    step = s[1] - s[0]
    q, first, second = group.curve.evaluate(s)
    model, data = result.path.robot.model, result.path.robot.model.createData()
    limited = [(first, second, np.zeros_like(q), np.array(ACCELERATION))]
    if torque is not None:
        still = np.zeros(model.nv)
        gravity, by_u, by_x = (
            np.array([pin.rnea(model, data, *state) for state in zip(q, v, a, strict=True)])
            for v, a in ((0.0 * q, 0.0 * q), (0.0 * q, first), (first, second))
        )
        assert still.size == q.shape[1]
        limited.append((by_u - gravity, by_x - gravity, gravity, np.array(torque)))
    rows: list[tuple[np.ndarray, ...]] = []
    bounds: list[FloatArray] = []
    gridpoint = np.arange(count)
    for by_u, by_x, rest, ranges in limited:
        for at in (0, 1):  # at both ends of an interval
            u, x, g = (part[at : count + at] for part in (by_u, by_x, rest))
            for sign, bound in ((-1.0, -ranges[:, 0]), (1.0, ranges[:, 1])):
                for joint in range(q.shape[1]):
                    own = sign * u[:, joint] / (2.0 * step), sign * x[:, joint]
                    number = len(bounds) * count + gridpoint
                    columns = -own[0] + (own[1] if at == 0 else 0.0), own[0] + (own[1] if at == 1 else 0.0)
                    rows += [(number, gridpoint, columns[0]), (number, gridpoint + 1, columns[1])]
                    bounds.append(bound[joint] - sign * g[:, joint])
    matrix = coo_matrix(
        (np.concatenate([row[2] for row in rows]), tuple(np.concatenate([row[k] for row in rows]) for k in (0, 1)))
    )
    speeds = 1.0 / np.maximum(shares(first, VELOCITY).max(axis=1), 1e-9) ** 2
    speeds[[0, -1]] = 0.0
    found = linprog(
        -np.ones(count + 1),
        matrix.tocsr(),
        np.concatenate(bounds),
        bounds=list(zip(np.zeros(count + 1), speeds, strict=True)),
        method="highs",
    )
    assert found.success
    speed = np.sqrt(np.maximum(found.x, 0.0))
    return float((2.0 * step / (speed[1:] + speed[:-1])).sum())


@pytest.mark.parametrize("with_torque", [False, True])
def test_time_optimal_lines_are_as_fast_as_a_linear_program(with_torque: bool) -> None:
    torque = tuple((-0.16 * t, 0.05 * t) for t in ROBOT.limit("torque")) if with_torque else None
    move = RelativeWaypoint(CartesianMove((-0.1, -0.6, -0.3)), "base", motion=LinearMotion())
    limits = replace(RANGES, torque_range=torque)
    result = plan(PlanningProblem(ROBOT, [TRIP[0], move], limits), Toppra())
    assert result.trajectory.duration == pytest.approx(least_time(result, torque), rel=5e-3)
    if torque is not None:
        free = plan(PlanningProblem(ROBOT, [TRIP[0], move], RANGES), Toppra()).trajectory.duration
        assert result.trajectory.duration > 1.02 * free
        used = np.array(
            [
                shares(np.array(pin.rnea(ROBOT.model, ROBOT.model.createData(), *state)), torque)
                for state in zip(*sampled(result, 500), strict=True)
            ]
        )
        (check,) = [check for check in result.certificate.checks if check.quantity == "torque"]
        assert used.max() <= 1.0 + 1e-9
        assert check.ratio == pytest.approx(used.max(), rel=0.01)


def test_a_torque_in_one_direction_holds_the_arm_and_in_the_other_does_not() -> None:
    """The shoulder needs a negative torque against gravity: less than a tenth of its limit in the other direction."""
    still = np.zeros(ROBOT.dof)
    gravity = pin.rnea(ROBOT.model, ROBOT.model.createData(), np.array(START), still, still)
    assert abs(gravity[1]) > 100.0
    wide = ROBOT.limit("torque")
    narrow, sign = wide.copy(), np.sign(gravity[1])
    narrow[1] = 0.5 * abs(gravity[1])
    pairs = tuple(zip(-wide, np.where(np.arange(6) == 1, narrow, wide), strict=True))
    if sign > 0.0:
        pairs = tuple((-upper, -lower) for lower, upper in pairs)
    short = [TRIP[0], JointWaypoint((0.4, -1.2, 1.4, 0.2, 0.6, 0.1))]
    for backend in ALL:
        assert plan(PlanningProblem(ROBOT, short, Limits(torque_range=pairs)), backend).certificate.satisfied
    turned = tuple((-upper, -lower) for lower, upper in pairs)
    with pytest.raises(LimitsUnsatisfiable) as refusal:
        plan(PlanningProblem(ROBOT, short, Limits(torque_range=turned)), Toppra())
    assert refusal.value.joint == ROBOT.joint_names[1]
    assert refusal.value.limit == pytest.approx(narrow[1])


@pytest.mark.parametrize(
    ("limits", "field"),
    [
        (Limits(velocity_range=VELOCITY[:5]), ("limits", "velocity_range")),
        (Limits(velocity_range=((0.0, 1.0), *VELOCITY[1:])), ("limits", "velocity_range", 0)),
        (Limits(acceleration_range=((-1.0, float("inf")), *ACCELERATION[1:])), ("limits", "acceleration_range", 0)),
        (Limits(velocity_range=((-100.0, 1.0), *VELOCITY[1:])), ("limits", "velocity_range", 0)),
    ],
)
def test_ranges_that_are_none_are_refused(limits: Limits, field: tuple[object, ...]) -> None:
    with pytest.raises(InvalidProblem) as refusal:
        plan(PlanningProblem(ROBOT, TRIP, limits))
    assert [fault.field for fault in refusal.value.faults] == [field]


def test_scales_and_narrower_limits_hold_for_ranges_too() -> None:
    own = Limits(velocity=tuple(0.5 * ROBOT.limit("velocity")), velocity_scale=0.5)
    limits = PlanningProblem(ROBOT, [TRIP[0], replace(TRIP[2], limits=own)], RANGES).segment_limits()
    lower, upper = limits.bounds("velocity")
    np.testing.assert_allclose(lower[0], -0.25 * ROBOT.limit("velocity"))
    np.testing.assert_allclose(upper[0], 0.2 * ROBOT.limit("velocity"))
