"""Acceleration and jerk limits by payload and speed: every back end and the bounds against dense samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.backends import BACKENDS
from planner.certificate import Check, certify
from planner.constraints import ACCELERATION_AT_SPEED, JERK_AT_SPEED, Bounds
from planner.constraints.at_speed import RateAtSpeed
from planner.constraints.bounded import BOUND_KNOWN_TO, bounded_peaks
from planner.constraints.peaks import SampledConstraints
from planner.dynamics import SegmentDynamics
from planner.errors import InvalidRobotModel
from planner.guarantees import Guarantee
from planner.limits import Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.robots import PayloadTable, Robot, load_robot
from planner.robots.payload import Payload
from planner.robots.varying.torque_curves import TorqueCurve, TorqueCurves
from planner.spatial import FloatArray
from planner.trajectories.extrema import derivatives_on_unit_time
from planner.trajectories.polynomials import PiecewisePolynomial
from tests.planner.problems_of_tests import backend_of
from tests.sizes import diagonal

MASSES, SPEEDS = (1.0, 5.0), (0.1, 0.4, 1.0)
OF_ACCELERATION = ((1.0, 0.6, 0.3), (0.8, 0.4, 0.2))
OF_JERK = ((0.9, 0.7, 0.25), (0.5, 0.45, 0.2))
TABLE = PayloadTable(MASSES, (1.0, 0.6), (1.0, 0.7), SPEEDS, OF_ACCELERATION, OF_JERK)
LOAD = Payload(3.0, (0.02, 0.0, 0.08))
WAYPOINTS = [(0.0, -1.2, 1.4, -0.4, 1.0, 0.0), (0.9, -0.7, 0.8, 0.3, 1.5, 0.8), (0.2, -1.4, 1.6, 0.0, 0.6, 0.2)]
CHECKS = {"acceleration": ACCELERATION_AT_SPEED, "jerk": JERK_AT_SPEED}


def ur5() -> Robot:
    return load_robot("ur5e").derived(payload_table=TABLE)


def allowed(robot: Robot, quantity: str, mass: float, speeds: FloatArray) -> FloatArray:
    """Return the limits (N, joints) at speeds (N, joints), by numpy alone."""
    whole, rows = {"acceleration": ((1.0, 0.6), OF_ACCELERATION), "jerk": ((1.0, 0.7), OF_JERK)}[quantity]
    factors = [np.interp(mass, MASSES, column) for column in np.array(rows).T]
    shares = np.interp(speeds / robot.limit("velocity"), SPEEDS, factors)
    return np.interp(mass, MASSES, whole) * robot.limit(quantity) * shares


def largest_share(made: Plan, quantity: str, mass: float) -> float:
    """Return the largest used share at dense times and at both ends of each piece."""
    trajectory, robot = made.trajectory, made.problem.robot
    inside = trajectory.breakpoints[:-1, None] + trajectory.lengths[:, None] * np.array([1e-9, 1.0 - 1e-9])
    times = np.sort(np.concatenate([np.linspace(0.0, trajectory.duration, 100_000), inside.ravel()]))
    speeds, rates = trajectory.evaluate(times, [1, 2 if quantity == "acceleration" else 3])
    return float((np.abs(rates) / allowed(robot, quantity, mass, np.abs(speeds))).max())


def check_of(made: Plan, quantity: str) -> Check:
    (check,) = (check for check in made.certificate.checks if check.quantity == f"{quantity}_at_speed")
    return check


@pytest.mark.long_table
@pytest.mark.parametrize(("kind", "quantity"), diagonal(BACKENDS, CHECKS))
def test_every_back_end_keeps_the_tables(kind: str, quantity: str) -> None:
    backend = backend_of(kind)
    made = plan(PlanningProblem(ur5(), [JointWaypoint(q) for q in WAYPOINTS], payload=LOAD), backend)
    check, true = check_of(made, quantity), largest_share(made, quantity, LOAD.mass)
    assert check.method == "bounded"
    assert check.enforced == (backend.guarantees[quantity] is Guarantee.HARD)
    if check.ratio is not None:
        assert true <= check.ratio * (1.0 + 1e-9)
        assert check.ratio == pytest.approx(true, rel=1e-3)
    if check.enforced:
        assert check.satisfied
        assert true <= 1.0 + 2e-9


@pytest.mark.long_table
@pytest.mark.parametrize("kind", ["quintic", "ruckig", "toppra", "trapezoidal"])
def test_the_tables_are_used(kind: str) -> None:
    made = plan(PlanningProblem(ur5(), [JointWaypoint(q) for q in WAYPOINTS], payload=LOAD), kind)
    binding = [
        check.ratio or 0.0
        for check in made.certificate.checks
        if check.quantity.endswith("_at_speed") and check.enforced
    ]
    assert max(binding) == pytest.approx(1.0, abs=1e-3)
    without = plan(PlanningProblem(load_robot("ur5e"), made.problem.waypoints, payload=LOAD), kind)
    assert without.trajectory.duration < made.trajectory.duration
    assert not any(check.quantity.endswith("_at_speed") for check in without.certificate.checks)
    named = [
        check.relaxed_by
        for check in made.certificate.checks
        if check.quantity == "acceleration_at_speed" and (check.ratio or 0.0) > 0.995
    ]
    assert all("robot.payload_table" in fields for fields in named)


def test_a_time_scaling_along_the_path_is_faster_than_a_uniform_stretch() -> None:
    """The time of `quintic` is that of its uniform stretch; `ruckig` is slower only where the table says so."""
    robot = load_robot("ur5e").derived(payload_table=replace(TABLE, jerk_at_speeds=None))
    problem = PlanningProblem(robot, [JointWaypoint(q) for q in WAYPOINTS])
    assert plan(problem, "ruckig").trajectory.duration < 0.95 * plan(problem, "quintic").trajectory.duration


def test_each_segment_has_the_table_of_its_payload() -> None:
    first, second, third = WAYPOINTS
    waypoints = [JointWaypoint(first), JointWaypoint(second, payload=Payload(4.5)), JointWaypoint(third)]
    made = plan(PlanningProblem(ur5(), waypoints), "toppra")
    trajectory, robot = made.trajectory, ur5()
    for segment, mass in ((0, 0.0), (1, 4.5)):
        times = np.linspace(trajectory.arrivals[segment] + 1e-9, trajectory.arrivals[segment + 1] - 1e-9, 50_000)
        v, a = trajectory.evaluate(times, [1, 2])
        used = (np.abs(a) / allowed(robot, "acceleration", mass, np.abs(v))).max()
        assert used <= 1.0 + 1e-8
        assert used == pytest.approx(1.0, abs=2e-3)


def test_scales_and_requested_limits_hold_beside_the_tables() -> None:
    made = plan(
        PlanningProblem(ur5(), [JointWaypoint(q) for q in WAYPOINTS], limits=Limits(acceleration_scale=0.5)), "toppra"
    )
    assert largest_share(made, "acceleration", 0.0) == pytest.approx(0.5, rel=1e-3)
    assert check_of(made, "acceleration").satisfied


@pytest.mark.parametrize("constraint", CHECKS.values(), ids=list(CHECKS))
def test_bounds_on_random_motions_hold_and_are_reached(constraint: RateAtSpeed) -> None:
    robot, rng = ur5(), np.random.default_rng(5)
    for _ in range(4):
        lengths = rng.uniform(0.2, 1.5, 3)
        motion = PiecewisePolynomial(lengths, rng.uniform(-0.6, 0.6, (3, 6, 6)) / (1.0 + np.arange(6)) ** 2)
        derivatives = derivatives_on_unit_time(motion, 6)
        limited = SampledConstraints(
            SegmentDynamics.unchanged(robot), [(constraint, Bounds.of_magnitudes(np.ones((1, 6))))], 1
        )
        found = bounded_peaks(limited, np.zeros(3, dtype=int), derivatives, lengths)
        pieces, units = np.repeat(np.arange(3), 100_000), np.tile(np.linspace(0.0, 1.0, 100_000), 3)
        _, v, a, j = derivatives[:4].evaluate(pieces, units)
        rates = a if constraint is ACCELERATION_AT_SPEED else j
        dense = float((np.abs(rates) / allowed(robot, constraint.kept_with, 0.0, np.abs(v))).max())
        assert dense <= found.bound[0] * (1.0 + 1e-11)
        assert found.bound[0] <= found.reached[0] * (1.0 + 1.01 * BOUND_KNOWN_TO)
        assert found.reached[0] <= dense * (1.0 + 1e-5)


@pytest.mark.parametrize("constraint", CHECKS.values(), ids=list(CHECKS))
def test_the_largest_paces_are_those_of_bisection(constraint: RateAtSpeed) -> None:
    rng = np.random.default_rng(3)
    curves = TorqueCurves.of([TorqueCurve((0.1, 0.5, 1.0), (3.0, 1.0, 0.8)), TorqueCurve((0.0, 2.0), (5.0, 0.5)), None])
    rates, speeds = rng.normal(size=(2, 400, 3)) * rng.choice([0.0, 1e-3, 1.0, 30.0], (2, 400, 3))
    speeds, shares = np.abs(speeds), rng.uniform(0.2, 1.0, (400, 3))
    found = constraint.largest_paces(curves, rates, speeds, shares)
    low, high = np.zeros((400, 3)), np.full((400, 3), 1e9)
    for _ in range(120):
        middle = 0.5 * (low + high)
        keeps = np.abs(rates) * middle**constraint.order <= shares * curves.at(speeds * middle)
        low, high = np.where(keeps, middle, low), np.where(keeps, high, middle)
    limited = (rates != 0.0) & (np.arange(3) < 2)
    assert found[limited] == pytest.approx(low[limited], rel=1e-6)
    assert np.isinf(found[~limited]).all()


def test_a_trajectory_beyond_the_tables_is_not_certified() -> None:
    made = plan(PlanningProblem(load_robot("ur5e"), [JointWaypoint(q) for q in WAYPOINTS]), "quintic")
    certificate = certify(ur5(), made.trajectory)
    assert not certificate.satisfied
    assert not check_of(replace(made, certificate=certificate), "acceleration").satisfied


@pytest.mark.parametrize(
    "table",
    [
        replace(TABLE, speeds=()),
        replace(TABLE, speeds=(0.1, 0.4, 1.2)),
        replace(TABLE, speeds=(0.4, 0.1, 1.0)),
        replace(TABLE, acceleration_at_speeds=OF_ACCELERATION[:1]),
        replace(TABLE, jerk_at_speeds=((1.0, 0.5), (1.0, 0.5))),
        replace(TABLE, jerk_at_speeds=((0.5, 0.7, 0.8), (0.5, 0.5, 0.5))),
        replace(TABLE, acceleration_at_speeds=((0.5, 0.4, 0.3), (0.6, 0.4, 0.3))),
        replace(TABLE, acceleration_at_speeds=((0.5, 0.4, 0.0), (0.5, 0.4, 0.0))),
    ],
)
def test_faults_of_tables(table: PayloadTable) -> None:
    with pytest.raises(InvalidRobotModel):
        load_robot("ur5e").derived(payload_table=table)


def test_a_table_may_not_widen_the_one_that_it_replaces() -> None:
    robot = ur5()
    robot.derived(payload_table=replace(TABLE, acceleration_at_speeds=((0.9, 0.5, 0.2), (0.7, 0.3, 0.1))))
    for wider in (replace(TABLE, acceleration_at_speeds=None), replace(TABLE, speeds=(0.2, 0.5, 1.0))):
        with pytest.raises(InvalidRobotModel, match="must not allow more"):
            robot.derived(payload_table=wider)
