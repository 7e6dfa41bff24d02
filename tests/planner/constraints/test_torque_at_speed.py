"""Torque limits that depend on the speed: every back end against Pinocchio at dense samples, and their bounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from planner import (
    InvalidRobotModel,
    JointWaypoint,
    PlanningProblem,
    Robot,
    ThroughTransition,
    TorqueCurve,
    certify,
    load_robot,
    plan,
)
from planner.backends import BACKENDS
from planner.constraints import TORQUE_AT_SPEED, Bounds
from planner.constraints.at_speed import largest_paces, rows_at_speed
from planner.constraints.bounded import BOUND_KNOWN_TO, bounded_peaks
from planner.constraints.peaks import SampledConstraints
from planner.dynamics import SegmentDynamics
from planner.plans.result import Plan
from planner.robots import DHJoint
from planner.robots.payload import Payload
from planner.robots.varying.torque_curves import TorqueCurves
from planner.spatial import FloatArray
from planner.trajectories.extrema import derivatives_on_unit_time
from planner.trajectories.polynomials import PiecewisePolynomial
from tests.sizes import NAME, diagonal

SAMPLES = {"quick": 20_000, "large": 100_000, "soak": 100_000}[NAME]
"""Samples of each plan."""

LOAD = Payload(2.0, (0.02, 0.0, 0.08))
"""The payload of the UR5."""

SHAPES = {
    "concave": ((0.1, 0.4, 1.0), (0.55, 0.5, 0.2)),
    "field weakening": ((0.1, 0.2, 0.4, 1.0), (0.6, 0.45, 0.32, 0.25)),
    "steps": ((0.0, 0.2, 0.25, 0.8, 0.85), (0.7, 0.65, 0.45, 0.44, 0.3)),
}
"""Curves as shares of the velocity and the torque limit: speeds, then torques."""


def ur5(shape: str) -> Robot:
    """Return a UR5 whose joints all have a torque curve."""
    robot, (speeds, torques) = load_robot("ur5e"), SHAPES[shape]
    curves = {
        joint.name: TorqueCurve(tuple(x * joint.velocity for x in speeds), tuple(x * joint.torque for x in torques))
        for joint in robot.joints
    }
    return robot.derived(limits={name: {"torque_curve": curve} for name, curve in curves.items()})


def through(seed: int) -> list[JointWaypoint]:
    """Return random joint positions, one of the inner ones passed without stopping."""
    positions = np.random.default_rng(seed).uniform(-1.4, 1.4, (4, 6))
    made = [JointWaypoint(tuple(q.tolist())) for q in positions]
    return [made[0], replace(made[1], transition=ThroughTransition()), *made[2:]]


def swinging() -> list[JointWaypoint]:
    """Return motions of the whole arm up and down that need most torque while they are fast."""
    low, high = (0.0, -0.4, 0.8, 0.0, 0.5, 0.0), (0.0, -2.4, 0.2, 0.0, 0.5, 0.0)
    return [JointWaypoint(q) for q in (low, high, low)]


def shares(made: Plan, robot: Robot) -> FloatArray:
    """Return the used shares (N, joints) by Pinocchio and numpy, at dense times and both ends of each piece."""
    trajectory = made.trajectory
    inside = trajectory.breakpoints[:-1, None] + trajectory.lengths[:, None] * np.array([1e-6, 1.0 - 1e-6])
    times = np.sort(np.concatenate([np.linspace(0.0, trajectory.duration, SAMPLES), inside.ravel()]))
    states = trajectory.evaluate(times, [0, 1, 2])
    model, data = robot.model, robot.model.createData()
    torques = np.array([pin.rnea(model, data, *state) for state in zip(*states, strict=True)])
    curves = [joint.torque_curve for joint in robot.joints]
    allowed = [np.interp(np.abs(v), c.speeds, c.torques) for v, c in zip(states[1].T, curves, strict=True) if c]
    return np.abs(torques) / np.stack(allowed, axis=1)


@pytest.mark.long_table
@pytest.mark.parametrize(("kind", "shape", "waypoints"), diagonal(BACKENDS, SHAPES, [through(3), swinging()]))
def test_every_back_end_keeps_torque_curves(kind: str, shape: str, waypoints: list[JointWaypoint]) -> None:
    robot = ur5(shape)
    made = plan(PlanningProblem(robot, waypoints, payload=LOAD), BACKENDS[kind]())
    dense = shares(made, robot.with_payload(LOAD))
    (check,) = (check for check in made.certificate.checks if check.quantity == "torque_at_speed")
    assert check.method == "bounded" and check.satisfied and check.unit(robot) == "N m"
    assert check.ratio is not None and check.lower is not None and check.limit is not None
    assert dense.max() <= check.ratio * (1.0 + 1e-10) <= 1.0 + 1e-8
    assert check.ratio <= dense.max() * (1.0 + 1e-3) and check.lower <= check.peak <= check.lower * (1.0 + 1e-5)
    assert check.joint == robot.joint_names[int(dense.max(axis=0).argmax())]
    free = plan(PlanningProblem(load_robot("ur5e"), waypoints, payload=LOAD), BACKENDS[kind]())
    assert free.trajectory.duration < made.trajectory.duration, "the limit binds"
    joint, loaded = robot.joint_names.index(check.joint), robot.with_payload(LOAD)
    times = np.clip(check.time + np.array([-1e-9, 1e-9]), 0.0, made.trajectory.duration)  # accelerations may jump there
    states = zip(*made.trajectory.evaluate(times, [0, 1, 2]), strict=True)
    torques = [pin.rnea(loaded.model, loaded.model.createData(), *state)[joint] for state in states]
    assert max(map(abs, torques)) == pytest.approx(check.lower, rel=1e-6)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_time_scaling_along_the_path_is_faster_than_a_uniform_stretch(shape: str) -> None:
    problem = PlanningProblem(ur5(shape), swinging(), payload=LOAD)
    assert plan(problem, "ruckig").trajectory.duration < 0.95 * plan(problem, "quintic").trajectory.duration


@pytest.mark.long_table
@pytest.mark.parametrize("factor", [1.05, 1.7, 6.0])
@pytest.mark.parametrize("kind", ["quintic", "ruckig", "toppra"])
def test_longer_durations_keep_torque_curves_as_the_shortest_do(kind: str, factor: float) -> None:
    robot = ur5("steps")
    problem = PlanningProblem(robot, swinging(), payload=LOAD)
    longer = replace(problem, duration=factor * plan(problem, kind).trajectory.duration)
    assert shares(plan(longer, kind), robot.with_payload(LOAD)).max() <= 1.0 + 1e-8


def test_a_trajectory_beyond_the_curves_is_not_certified() -> None:
    made = plan(PlanningProblem(load_robot("ur5e"), swinging()), "trapezoidal")
    certificate = certify(ur5("steps"), made.trajectory)
    (check,) = (check for check in certificate.checks if check.quantity == "torque_at_speed")
    assert not certificate.satisfied and check.ratio is not None and check.ratio > 1.1


@pytest.mark.parametrize("shape", SHAPES)
def test_bounds_on_random_motions_hold_and_are_reached(shape: str) -> None:
    robot, rng = ur5(shape), np.random.default_rng(5)
    for _ in range(5):
        lengths = rng.uniform(0.2, 1.5, 3)
        motion = PiecewisePolynomial(lengths, rng.uniform(-0.6, 0.6, (3, 6, 6)) / (1.0 + np.arange(6)) ** 2)
        derivatives = derivatives_on_unit_time(motion, 6)
        one = [(TORQUE_AT_SPEED, Bounds.of_magnitudes(np.ones((1, 6))))]
        limited = SampledConstraints(SegmentDynamics.unchanged(robot), one, 1)
        found = bounded_peaks(limited, np.zeros(3, dtype=int), derivatives, lengths)
        pieces, units = np.repeat(np.arange(3), 3000), np.tile(np.linspace(0.0, 1.0, 3000), 3)
        q, v, a = derivatives[:3].evaluate(pieces, units)
        data = robot.model.createData()
        torques = np.abs([pin.rnea(robot.model, data, *state) for state in zip(q, v, a, strict=True)])
        curves = [joint.torque_curve for joint in robot.joints]
        allowed = [np.interp(np.abs(w), c.speeds, c.torques) for w, c in zip(v.T, curves, strict=True) if c]
        dense = float((torques / np.stack(allowed, axis=1)).max())
        assert dense <= found.bound[0] * (1.0 + 1e-11)
        assert found.bound[0] <= found.reached[0] * (1.0 + 1.01 * BOUND_KNOWN_TO)
        assert found.reached[0] <= dense * (1.0 + 1e-3)


def random_curves(rng: np.random.Generator) -> list[TorqueCurve | None]:
    """Draw falling curves for all joints except the last."""
    curves: list[TorqueCurve | None] = [None]
    for count in range(2, 7):
        speeds = np.sort(rng.uniform(0.0, 3.0, count))
        curves.insert(0, TorqueCurve(tuple(speeds), tuple(np.sort(rng.uniform(0.2, 2.0, count))[::-1])))
    return curves


@pytest.mark.large_only
def test_the_first_pace_beyond_a_curve_is_that_of_dense_samples() -> None:
    rng = np.random.default_rng(27)
    for _ in range(20):
        curves = random_curves(rng)
        held, moved = rng.uniform(-0.2, 0.2, (300, 6)), rng.normal(size=(300, 6)) * 10.0 ** rng.uniform(-2, 1, (300, 6))
        speeds = np.abs(rng.normal(size=(300, 6))) * (rng.random((300, 6)) < 0.9)
        paces = largest_paces(TorqueCurves.of(curves), held, moved, speeds)
        assert np.isinf(paces[:, -1]).all() and np.isfinite(paces[:, :-1]).all()
        for joint, curve in enumerate(curves[:-1]):
            assert curve is not None
            x = np.linspace(0.0, 1.0 - 1e-9, 1001)[:, None] * paces[:, joint]
            share = np.abs(held[:, joint] + moved[:, joint] * x**2) / curve.at(speeds[:, joint] * x)
            assert share.max() <= 1.0 + 1e-9
            beyond = paces[:, joint] * (1.0 + 1e-7)
            share = np.abs(held[:, joint] + moved[:, joint] * beyond**2) / curve.at(speeds[:, joint] * beyond)
            assert (share >= 1.0 - 1e-9).all()


def test_rows_of_a_retiming_allow_rest_and_are_exact_near_a_kept_time_scaling() -> None:
    rng = np.random.default_rng(3)
    of_all = TorqueCurves.of(random_curves(rng)[:-1])
    by_b, by_a, held = (rng.normal(size=(4000, 5)) * scale for scale in (0.5, 0.5, 0.05))
    speeds = np.abs(rng.normal(size=(4000, 5)))
    for share in (3.0, 1.0, 0.3):  # of the largest pace: too fast, at the limit, slow
        pace = share * largest_paces(of_all, held, by_b, speeds)
        rows = rows_at_speed(of_all, by_b * pace**2, by_a, held, speeds * pace)
        assert all((np.abs(offset) < constant).all() for *_, offset, constant in rows)
        parts = np.array([(by_b * pace**2 + held) / of_all.at(speeds * pace)])
        used = np.max([np.abs(row + offset) / constant for row, _, offset, constant in rows], axis=0)
        if share == 1.0:
            assert np.abs(parts) == pytest.approx(1.0, abs=1e-6)
            assert (used > 1.0 - 1e-6).all() and np.median(used) < 1.0 + 1e-6
        elif share < 1.0:
            assert (used < 1.0).all()


@pytest.mark.parametrize(
    ("speeds", "torques"),
    [
        ((0.0,), (1.0,)),
        ((0.0, 0.0), (1.0, 1.0)),
        ((-1.0, 1.0), (2.0, 1.0)),
        ((0.0, 1.0), (1.0, 2.0)),
        ((0.0, 1.0), (1.0, 0.0)),
        ((0.0, 1.0, 2.0), (1.0, 0.5)),
        ((0.0, np.nan), (1.0, 0.5)),
    ],
)
def test_curves_that_make_no_sense_are_refused(speeds: tuple[float, ...], torques: tuple[float, ...]) -> None:
    row = DHJoint("revolute", a=0.4, mass=1.0, torque_curve=TorqueCurve(speeds, torques))
    with pytest.raises(InvalidRobotModel, match="torque curve of joint_1"):
        Robot.from_dh([row, DHJoint("revolute", a=0.3, mass=1.0)])


def test_a_curve_lowers_the_torque_limit_and_no_owner_raises_it() -> None:
    row = DHJoint("revolute", a=0.4, mass=1.0, torque_curve=TorqueCurve((0.5, 2.0), (30.0, 10.0)))
    robot = Robot.from_dh([row, replace(row, torque=20.0)])
    assert robot.limit("torque").tolist() == [30.0, 20.0]
    lower = TorqueCurve((0.0, 2.0), (25.0, 10.0))
    assert robot.derived(limits={"joint_1": {"torque_curve": lower}}).joints[0].torque == 25.0
    with pytest.raises(InvalidRobotModel, match="must not be above"):
        robot.derived(limits={"joint_1": {"torque_curve": TorqueCurve((0.0, 3.0), (30.0, 10.0))}})
