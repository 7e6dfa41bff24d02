"""Limits of the continuous (RMS) torque: every back end against Pinocchio and dense sums, and the remedies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from planner import (
    InvalidProblem,
    JointWaypoint,
    Limits,
    LimitsUnsatisfiable,
    MissingDynamics,
    PlanningProblem,
    Robot,
    StopTransition,
    ThroughTransition,
    certify,
    load_robot,
    plan,
)
from planner.backends import BACKENDS
from planner.constraints.rms_torque import RmsTorque, bound_rms_torque
from planner.dynamics import SegmentDynamics
from planner.robots import DHJoint
from planner.robots.payload import Payload
from planner.spatial import FloatArray
from planner.trajectories.trajectory import Trajectory
from tests.sizes import NAME, diagonal

SAMPLES = {"quick": 40_000, "large": 100_000, "soak": 100_000}[NAME]
"""Approximate number of samples of each trajectory."""

LOAD = Payload(3.0, (0.02, 0.0, 0.08))
"""The payload of the UR5."""


def rms(trajectory: Trajectory, robot: Robot, cycle: float = 0.0, at_end: Robot | None = None) -> FloatArray:
    """Return RMS torques (joints,) by Pinocchio and the midpoint rule on each piece, with a rest at the end."""
    model, data = robot.model, robot.model.createData()
    squares = np.zeros(robot.dof)
    for piece, length in enumerate(trajectory.lengths):
        count = max(int(SAMPLES * length / trajectory.duration), 20)
        times = (np.arange(count) + 0.5) / count * length
        states = trajectory.evaluate_on(np.full(count, piece), times, [0, 1, 2])
        torques = np.array([pin.rnea(model, data, *state) for state in zip(*states, strict=True)])
        squares += (torques**2).sum(axis=0) * length / count
    last = trajectory.evaluate(trajectory.duration, [0])[0]
    end = at_end or robot
    held = pin.rnea(end.model, end.model.createData(), last, 0.0 * last, 0.0 * last)
    whole = max(cycle, trajectory.duration)
    return np.sqrt((squares + (whole - trajectory.duration) * held**2) / whole)


def waypoints(seed: int) -> list[JointWaypoint]:
    """Return random joint positions with a rest at one and without a stop at another."""
    positions = np.random.default_rng(seed).uniform(-1.4, 1.4, (4, 6))
    made = [JointWaypoint(tuple(q.tolist())) for q in positions]
    made[1], made[2] = replace(made[1], dwell=0.3), replace(made[2], transition=ThroughTransition())
    return made


@pytest.mark.long_table
@pytest.mark.parametrize(("kind", "seed"), diagonal(BACKENDS, [2, 5]))
def test_every_back_end_takes_longer_until_the_rms_torque_is_kept(kind: str, seed: int) -> None:
    robot = load_robot("ur5e")
    problem = PlanningProblem(robot, waypoints(seed), payload=LOAD)
    free, loaded = plan(problem, BACKENDS[kind]()), robot.with_payload(LOAD)
    needed = rms(free.trajectory, loaded)
    held = rms(free.trajectory.scaled(50.0), loaded)
    joint = int((needed / held).argmax())
    limits = np.where(np.arange(6) == joint, (needed + held) / 2.0, 1.5 * needed)
    made = plan(replace(problem, limits=Limits(rms_torque=tuple(limits))), BACKENDS[kind]())
    used = rms(made.trajectory, loaded) / limits
    (check,) = (check for check in made.certificate.checks if check.quantity == "rms_torque")
    assert check.satisfied and check.method == "bounded" and check.joint == robot.joint_names[joint]
    assert check.ratio is not None and check.lower is not None and check.unit(robot) == "N m"
    assert 1.0 - 1e-5 < check.ratio <= 1.0 + 1e-9
    assert used.max() == pytest.approx(check.ratio, rel=1e-6)
    assert check.lower <= check.peak <= check.lower * (1.0 + 1e-7)
    assert made.trajectory.duration > free.trajectory.duration
    rests = [trajectory.departures - trajectory.arrivals for trajectory in (free.trajectory, made.trajectory)]
    np.testing.assert_allclose(*rests, atol=1e-12)


@pytest.mark.large_only
def test_rest_in_the_cycle_counts_with_the_torque_that_holds_the_arm() -> None:
    robot = load_robot("ur5e")
    made = plan(PlanningProblem(robot, waypoints(5), payload=LOAD), "ruckig")
    loaded = robot.with_payload(LOAD)
    for cycle in (0.0, 1.0, made.trajectory.duration + 1.0, 30.0):
        expected = rms(made.trajectory, loaded, cycle)
        limits = Limits(rms_torque=tuple(expected * 1.0001), cycle_time=cycle or None)
        certificate = certify(loaded, made.trajectory, limits=limits)
        (check,) = (check for check in certificate.checks if check.quantity == "rms_torque")
        assert check.satisfied and check.ratio == pytest.approx(1.0 / 1.0001, rel=1e-6)
        tight = Limits(rms_torque=tuple(expected * 0.9999), cycle_time=cycle or None)
        assert not certify(loaded, made.trajectory, limits=tight).satisfied


def test_a_payload_that_is_put_down_counts_on_its_segments_and_not_in_the_rest() -> None:
    robot = load_robot("ur5e")
    positions = np.random.default_rng(7).uniform(-1.2, 1.2, (3, 6))
    stops = [JointWaypoint(tuple(q.tolist()), put_down=i == 1) for i, q in enumerate(positions)]
    made = plan(PlanningProblem(robot, stops, payload=LOAD, limits=Limits(rms_torque=(200.0,) * 6, cycle_time=9.0)))
    trajectory = made.trajectory
    lower, upper = bound_rms_torque(made.path.dynamics, trajectory, RmsTorque(np.full(6, 200.0), 9.0))
    first, second = (trajectory.of(np.flatnonzero(trajectory.segments == k)) for k in (0, 1))
    squares = np.zeros(6)
    for part, own in ((first, robot.with_payload(LOAD)), (second, robot)):
        times = (np.arange(40_000) + 0.5) / 40_000 * part.lengths.sum()
        states = part.evaluate(times, [0, 1, 2])
        data = own.model.createData()
        torques = np.array([pin.rnea(own.model, data, *state) for state in zip(*states, strict=True)])
        squares += (torques**2).mean(axis=0) * part.lengths.sum()
    still = np.zeros(6)
    held = pin.rnea(robot.model, robot.model.createData(), positions[-1], still, still)
    expected = np.sqrt((squares + (9.0 - trajectory.duration) * held**2) / 9.0)
    np.testing.assert_allclose(upper, expected, rtol=1e-5)
    assert (lower <= upper).all()


@pytest.mark.parametrize("seed", range(4))
def test_bounds_of_the_integral_enclose_dense_sums_closely(seed: int) -> None:
    robot, rng = load_robot("kuka_kr16_2").with_payload(Payload(10.0)), np.random.default_rng(seed)
    lengths = rng.uniform(0.2, 1.5, 4)
    coefficients = rng.uniform(-0.8, 0.8, (4, 6, 6)) / (1.0 + np.arange(6)) ** 2
    times = np.array([0.0, lengths.sum()])
    trajectory = Trajectory(lengths, coefficients, np.zeros(4, dtype=int), times, times)
    expected = rms(trajectory, robot)
    lower, upper = bound_rms_torque(SegmentDynamics.unchanged(robot), trajectory, RmsTorque(expected))
    np.testing.assert_allclose(upper, expected, rtol=1e-6)
    assert (lower <= upper).all() and (upper <= lower * (1.0 + 1e-7)).all()


def refused(problem: PlanningProblem) -> LimitsUnsatisfiable:
    with pytest.raises(LimitsUnsatisfiable, match=r"the RMS torque of .* over a cycle of .* s, its limit is") as error:
        plan(problem, "quintic")
    return error.value


def test_a_refusal_offers_a_duration_a_cycle_time_and_a_payload_that_work() -> None:
    robot = load_robot("ur5e")
    free = PlanningProblem(robot, waypoints(5), payload=LOAD)
    duration = plan(free, "quintic").trajectory.duration
    needed = rms(plan(free, "quintic").trajectory, robot.with_payload(LOAD))
    problem = replace(free, duration=duration * 1.0001, limits=Limits(rms_torque=tuple(0.99 * needed)))
    remedies = {remedy.field: remedy.value for remedy in refused(problem).remedies}
    assert set(remedies) == {("duration",), ("limits", "cycle_time"), ("payload", "mass")}
    longer = replace(problem, duration=remedies["duration",])
    rested = replace(problem, limits=replace(problem.limits, cycle_time=remedies["limits", "cycle_time"]))
    lighter = replace(problem, payload=replace(LOAD, mass=remedies["payload", "mass"]))
    for better in (longer, rested, lighter):
        assert plan(better, "quintic").certificate.satisfied
    shorter = 0.999 * remedies["limits", "cycle_time"]
    assert refused(replace(problem, limits=replace(problem.limits, cycle_time=shorter)))
    heavier = replace(problem, payload=replace(LOAD, mass=1.01 * remedies["payload", "mass"]))
    assert refused(heavier)


def test_a_limit_below_what_holding_takes_is_refused_without_a_duration() -> None:
    robot = load_robot("ur5e")
    problem = PlanningProblem(robot, waypoints(2), payload=LOAD, limits=Limits(rms_torque=(20.0,) * 6))
    assert ("duration",) not in {remedy.field for remedy in refused(problem).remedies}


def test_a_robot_states_its_continuous_rating_and_a_request_narrows_it() -> None:
    row = DHJoint("revolute", a=0.5, mass=3.0, center_of_mass=(-0.2, 0.0, 0.0), alpha=np.pi / 2.0, rms_torque=50.0)
    robot = Robot.from_dh([row, replace(row, rms_torque=None)])
    assert robot.limit("rms_torque").tolist() == [50.0, np.inf]
    lower = robot.derived(limits={"joint_2": {"rms_torque": 30.0}})
    made = plan(PlanningProblem(lower, [(0.0, 0.0), (1.0, 0.4)]))
    assert "rms_torque" in {check.quantity for check in made.certificate.checks}
    with pytest.raises(InvalidProblem, match="wider than the robot's own rms_torque limit"):
        plan(PlanningProblem(lower, [(0.0, 0.0), (1.0, 0.4)], Limits(rms_torque=(60.0, 10.0))))


def test_limits_of_the_rms_torque_belong_to_the_whole_trajectory() -> None:
    robot = load_robot("ur5e")
    at_waypoint = replace(waypoints(2)[1], limits=Limits(rms_torque=(50.0,) * 6, cycle_time=9.0))
    with pytest.raises(InvalidProblem, match=r"waypoints\[1\].limits.rms_torque: must stand in the limits"):
        plan(PlanningProblem(robot, [waypoints(2)[0], at_waypoint]))
    arm = load_robot("three_dof_arm")
    with pytest.raises(MissingDynamics, match="RMS torque limits cannot be checked"):
        plan(PlanningProblem(arm, [(0.1, 0.1, 0.1), (0.2, 0.3, 0.1)], Limits(rms_torque=(1.0,) * 3)))


def test_requested_passing_velocities_keep_their_time_and_the_rest_is_slowed() -> None:
    robot = load_robot("ur5e")
    made = waypoints(2)
    passed = replace(made[2], transition=ThroughTransition(velocity=(0.1,) * 6))
    problem = PlanningProblem(robot, [made[0], made[1], passed, made[3]], payload=LOAD)
    free = plan(problem, "ruckig")
    needed = rms(free.trajectory, robot.with_payload(LOAD))
    kept = plan(replace(problem, limits=Limits(rms_torque=tuple(0.999 * needed))), "ruckig")
    durations = [np.diff(made.trajectory.arrivals) for made in (free, kept)]
    np.testing.assert_allclose(durations[0][1:], durations[1][1:], rtol=1e-9)
    assert isinstance(passed.transition, ThroughTransition) and not isinstance(passed.transition, StopTransition)
    assert durations[1][0] > durations[0][0]
