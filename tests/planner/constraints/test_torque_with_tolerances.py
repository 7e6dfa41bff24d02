"""Payload tolerances against Pinocchio's torques of drawn bodies."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.backends import BACKENDS
from planner.certificate import Check, certify
from planner.constraints import TORQUE_WITH_TOLERANCES
from planner.constraints.torque_with_tolerances import largest_squared_paces
from planner.errors import InvalidProblem, LimitsUnsatisfiable, PayloadExceeded
from planner.kinematics.forward import JointStates
from planner.limits import Limits
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.robots import Robot, load_robot
from planner.robots.payload import Payload
from planner.robots.varying.torque_curves import TorqueCurve
from planner.trajectories.trajectory import Trajectory
from tests.planner.kernels.arms import random_states, robots
from tests.planner.problems_of_tests import backend_of
from tests.sizes import diagonal

CENTER, MOMENTS = (0.05, 0.02, 0.15), (0.1, 0.2, 0.25)
GIVEN = Payload(15.0, CENTER, MOMENTS)
TOLERANCES = {
    "mass": replace(GIVEN, mass_tolerance=3.0),
    "center": replace(GIVEN, center_of_mass_tolerance=(0.05, 0.03, 0.08)),
    "inertia": replace(GIVEN, inertia_tolerance=0.3),
    "all": Payload(15.0, CENTER, MOMENTS, 3.0, (0.05, 0.03, 0.08), 0.3),
}
NAME = TORQUE_WITH_TOLERANCES.name
KUKA = replace(load_robot("kuka_kr16_2"), rated_payload=None)
WEAK = KUKA.derived(limits={joint.name: {"torque": 0.16 * joint.torque} for joint in KUKA.joints})
WAYPOINTS = [(0.0, -1.4, 1.5, 0.0, 0.6, 0.0), (0.6, -0.9, 1.2, 0.4, 0.9, 0.5), (0.2, -1.2, 1.4, 0.1, 0.5, 0.1)]


def bodies(payload: Payload, count: int) -> list[pin.Inertia]:
    """Draw bodies within the tolerances: at all ends, and inside."""
    ends = np.array(list(product((-1.0, 1.0), repeat=7)))
    inside = np.random.default_rng(count).uniform(-1.0, 1.0, (max(count - len(ends), 0), 7))
    rows = np.vstack([ends, inside])
    masses = payload.mass + rows[:, 0] * payload.mass_tolerance
    centers = np.array(payload.center_of_mass) + rows[:, 1:4] * payload.center_of_mass_tolerance
    moments = np.array(payload.inertia) * (1.0 + rows[:, 4:] * payload.inertia_tolerance)
    return [pin.Inertia(*body) for body in zip(masses, centers, map(np.diag, moments), strict=True)]


def torques(robot: Robot, body: pin.Inertia, states: np.ndarray) -> np.ndarray:
    """Return Pinocchio's torques (N, joints) of a robot that carries a body, at states (3, N, joints)."""
    model, tip = robot.model.copy(), robot.model.frames[robot.tip_frame_id]
    model.appendBodyToJoint(tip.parentJoint, body, tip.placement)
    data = model.createData()
    return np.array([pin.rnea(model, data, *state) for state in states.transpose(1, 0, 2)])


def extremes(robot: Robot, drawn: list[pin.Inertia], states: np.ndarray) -> np.ndarray:
    """Return the largest magnitudes (N, joints) of the torques with any of the bodies.

    Pinocchio's regressor gives the torques by the ten inertial parameters of the link that carries the body.
    """
    tip, data = robot.model.frames[robot.tip_frame_id], robot.model.createData()
    numbers = np.array([tip.placement.act(body).toDynamicParameters() for body in drawn]).T
    own, columns = torques(robot, pin.Inertia.Zero(), states), slice(10 * tip.parentJoint - 10, 10 * tip.parentJoint)
    regressors = [pin.computeJointTorqueRegressor(robot.model, data, *s).copy() for s in states.transpose(1, 0, 2)]
    with_body = own[:, :, None] + np.array(regressors)[:, :, columns] @ numbers
    assert with_body[:, :, -1] == pytest.approx(torques(robot, drawn[-1], states), abs=1e-9 * np.abs(with_body).max())
    largest: np.ndarray = np.abs(with_body).max(axis=2)
    return largest


def share(robot: Robot, payload: Payload, trajectory: Trajectory, limit: np.ndarray) -> float:
    """Return the largest share of a limit over dense times, with any of 1,000 bodies."""
    states = np.array(trajectory.evaluate(np.linspace(0.0, trajectory.duration, 1000), [0, 1, 2]))
    return float((extremes(robot, bodies(payload, 1000), states) / limit).max())


def check_of(robot: Robot, trajectory: Trajectory) -> Check:
    (check,) = (check for check in certify(robot, trajectory).checks if check.quantity == NAME)
    return check


@pytest.mark.parametrize("which", TOLERANCES)
@pytest.mark.parametrize("name", robots())
def test_the_values_bound_those_of_all_bodies(name: str, which: str) -> None:
    robot, payload = robots()[name], TOLERANCES[which]
    states = random_states(robot, 40)
    largest = extremes(robot, bodies(payload, 400), states)
    found = np.abs(TORQUE_WITH_TOLERANCES.values(JointStates(robot.with_payload(payload), *states)))
    size = largest.max(axis=0)
    assert (found >= largest - 1e-9 * size).all()
    assert found == pytest.approx(largest, abs=1e-9 * size.max() if which in ("mass", "inertia") else 0.05 * size.max())


@pytest.mark.long_table
@pytest.mark.parametrize("which", TOLERANCES)
@pytest.mark.parametrize("name", ["kuka", "on a rail", "on a wall"])
def test_the_certificate_bounds_all_bodies_at_all_times(name: str, which: str) -> None:
    robot, payload = replace(robots()[name], rated_payload=None), TOLERANCES[which]
    rng = np.random.default_rng(len(which))
    starts = [[0.3] * (robot.dof - 6) + list(q) for q in WAYPOINTS]
    ends = [JointWaypoint(tuple((q + rng.uniform(-0.5, 0.5, robot.dof)).tolist())) for q in np.array(starts)]
    for kind in ("quintic", "toppra"):
        trajectory = plan(PlanningProblem(robot, ends), kind).trajectory
        check = check_of(robot.with_payload(payload), trajectory)
        true = share(robot, payload, trajectory, robot.limit("torque"))
        assert check.method == "bounded"
        assert check.ratio is not None
        assert check.lower is not None
        assert check.lower <= check.peak <= check.lower * (1.0 + 2e-6)
        assert true <= check.ratio * (1.0 + 1e-9)
        assert check.ratio == pytest.approx(true, rel=0.03)


@pytest.mark.long_table
@pytest.mark.parametrize(("kind", "which"), diagonal(BACKENDS, TOLERANCES))
def test_every_back_end_keeps_the_limits_with_all_bodies_and_uses_them(kind: str, which: str) -> None:
    payload = TOLERANCES[which]
    made = plan(PlanningProblem(WEAK, [JointWaypoint(q) for q in WAYPOINTS], payload=payload), backend_of(kind))
    true = share(WEAK, payload, made.trajectory, WEAK.limit("torque"))
    (check,) = (check for check in made.certificate.checks if check.quantity == NAME)
    assert check.satisfied
    assert check.enforced
    assert check.ratio is not None
    assert true <= check.ratio * (1.0 + 1e-9) <= 1.0 + 2e-9
    assert check.ratio == pytest.approx(1.0, rel=0.03 if kind == "min_effort" else 5e-4)
    assert true == pytest.approx(check.ratio, rel=0.01)


def test_without_tolerances_nothing_is_checked_and_the_plan_is_the_same() -> None:
    problem = PlanningProblem(WEAK, [JointWaypoint(q) for q in WAYPOINTS], payload=GIVEN)
    assert NAME not in [check.quantity for check in plan(problem).certificate.checks]


def test_the_heaviest_body_alone_needs_the_time_of_a_mass_tolerance() -> None:
    """With the centre of mass given, a motion against gravity is as slow as with the largest mass."""
    waypoints = [JointWaypoint(q) for q in WAYPOINTS]
    for kind in ("toppra", "quintic", "ruckig"):
        payloads = TOLERANCES["mass"], replace(GIVEN, mass=18.0)
        within, heaviest = (
            plan(PlanningProblem(WEAK, waypoints, payload=payload), kind).trajectory.duration for payload in payloads
        )
        assert within == pytest.approx(heaviest, rel=2e-3)


def test_the_largest_pace_is_that_of_bisection() -> None:
    rng = np.random.default_rng(3)
    held, moved = rng.normal(size=(2, 7, 300)) * rng.choice([0.0, 1e-3, 1.0], (2, 7, 300))
    limits = np.abs(held).sum(axis=0) * rng.uniform(1.0, 3.0, 300) + 1e-9
    found = largest_squared_paces(held, moved, limits)
    low, high = np.zeros(300), np.full(300, 1e9)
    for _ in range(120):
        middle = 0.5 * (low + high)
        keeps = np.abs(held + moved * middle).sum(axis=0) <= limits
        low, high = np.where(keeps, middle, low), np.where(keeps, high, middle)
    bounded = np.abs(moved).sum(axis=0) > 0.0
    assert found[bounded] == pytest.approx(low[bounded], rel=1e-6, abs=1e-12)
    assert np.isinf(found[~bounded]).all()
    over = largest_squared_paces(held, moved, 0.5 * np.abs(held).sum(axis=0))
    assert (over[np.abs(held).sum(axis=0) > 0.0] >= 0.0).all()


def test_rows_along_a_path_are_torques_of_bodies_within_the_tolerances() -> None:
    robot = KUKA.with_payload(TOLERANCES["all"])
    q, first, second = random_states(KUKA, 30)
    rows = TORQUE_WITH_TOLERANCES.rows(JointStates(robot, q, first, second))
    for u, x in [(0.0, 0.0), (0.0, 2.0), (1.5, 0.5), (-3.0, 1.0)]:
        states = JointStates(robot, q, np.sqrt(x) * first, x * second + u * first)
        most = np.abs(TORQUE_WITH_TOLERANCES.values(states))
        each = np.abs(rows.by_u * u + rows.by_x * x + rows.rest).reshape(*q.shape, -1)
        assert (each.max(axis=2) <= most * (1.0 + 1e-9) + 1e-9).all()
        if u == x == 0.0:
            assert each.max(axis=2) == pytest.approx(most, rel=1e-9, abs=1e-9)


def test_tolerances_count_only_while_the_payload_is_carried() -> None:
    first, second, third = WAYPOINTS
    waypoints = [JointWaypoint(first), JointWaypoint(second, payload=TOLERANCES["all"]), JointWaypoint(third)]
    made = plan(PlanningProblem(WEAK, waypoints), "quintic")
    (check,) = (check for check in made.certificate.checks if check.quantity == NAME)
    assert check.satisfied
    assert check.time >= made.trajectory.arrivals[1]
    empty = plan(PlanningProblem(WEAK, [JointWaypoint(first), JointWaypoint(second)]), "quintic").trajectory
    assert made.trajectory.arrivals[1] == pytest.approx(empty.duration, rel=1e-6)
    times = np.linspace(made.trajectory.arrivals[1] + 1e-9, made.trajectory.duration, 500)
    states = np.array(made.trajectory.evaluate(times, [0, 1, 2]))
    used = extremes(WEAK, bodies(TOLERANCES["all"], 500), states) / WEAK.limit("torque")
    assert used.max() == pytest.approx(1.0, abs=0.01)
    assert used.max() <= 1.0 + 1e-9


def test_gravity_with_the_tolerances_is_refused() -> None:
    weaker = KUKA.derived(limits={joint.name: {"torque": 0.15 * joint.torque} for joint in KUKA.joints})
    waypoints = [JointWaypoint(q) for q in WAYPOINTS]
    plan(PlanningProblem(weaker, waypoints, payload=GIVEN), "toppra")
    for kind in ("toppra", "quintic", "ruckig"):
        with pytest.raises(LimitsUnsatisfiable, match="tolerances of the payload"):
            plan(PlanningProblem(weaker, waypoints, payload=replace(GIVEN, mass_tolerance=10.0)), kind)


@pytest.mark.parametrize(
    ("payload", "field"),
    [
        (replace(GIVEN, mass_tolerance=16.0), ("payload", "mass_tolerance")),
        (replace(GIVEN, mass_tolerance=-1.0), ("payload", "mass_tolerance")),
        (replace(GIVEN, center_of_mass_tolerance=(0.0, np.nan, 0.0)), ("payload", "center_of_mass_tolerance", 1)),
        (replace(GIVEN, inertia_tolerance=1.1), ("payload", "inertia_tolerance")),
    ],
)
def test_faults_of_tolerances(payload: Payload, field: tuple[str | int, ...]) -> None:
    with pytest.raises(InvalidProblem) as refusal:
        plan(PlanningProblem(KUKA, [JointWaypoint(q) for q in WAYPOINTS], payload=payload))
    assert field in [tuple(fault.field) for fault in refusal.value.faults]


def test_limits_that_hold_for_the_given_payload_alone_are_refused() -> None:
    problem = PlanningProblem(KUKA, [JointWaypoint(q) for q in WAYPOINTS], payload=TOLERANCES["mass"])
    for limits in (Limits(total_power=1e4), Limits(power=(1e4,) * 6), Limits(rms_torque=tuple(KUKA.limit("torque")))):
        with pytest.raises(InvalidProblem, match="tolerances"):
            plan(replace(problem, limits=limits))
        plan(replace(problem, limits=limits, payload=GIVEN))
    start, *rest = problem.waypoints
    limited = replace(problem, waypoints=[start, *(replace(each, limits=Limits(total_power=1e4)) for each in rest)])
    with pytest.raises(InvalidProblem) as refusal:
        plan(limited)
    fields = [tuple(fault.field) for fault in refusal.value.faults]
    assert fields == [("waypoints", k, "limits", "total_power") for k in (1, 2)]
    curve = TorqueCurve((0.0, 2.0), (KUKA.joints[0].torque, 0.9 * KUKA.joints[0].torque))
    curved = KUKA.derived(limits={KUKA.joint_names[0]: {"torque_curve": curve}})
    with pytest.raises(InvalidProblem, match="torque curves"):
        plan(replace(problem, robot=curved))


def test_the_rating_is_compared_with_the_largest_mass() -> None:
    rated = load_robot("kuka_kr16_2")
    waypoints = [JointWaypoint(q) for q in WAYPOINTS]
    allowed = rated.rated_payload
    assert allowed is not None
    plan(PlanningProblem(rated, waypoints, payload=Payload(allowed - 2.0, mass_tolerance=2.0)))
    with pytest.raises(PayloadExceeded) as refusal:
        plan(PlanningProblem(rated, waypoints, payload=Payload(allowed - 1.0, mass_tolerance=2.0)))
    (remedy,) = refusal.value.remedies
    assert remedy.value == pytest.approx(allowed - 2.0)


def test_a_proof_does_not_cover_tolerances() -> None:
    made = plan(PlanningProblem(KUKA, [JointWaypoint(q) for q in WAYPOINTS], payload=TOLERANCES["mass"]))
    statement = planner.write_proof(made)["statement"]
    assert NAME in statement["not_covered"]
    assert NAME not in statement["claims"]
