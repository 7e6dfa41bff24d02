"""Torque limits of joints with friction and rotors: all back ends and the certificate against dense samples."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

import planner
from planner import Limits, PlanningProblem
from planner.constraints import POWER, TORQUE, TORQUE_AT_SPEED, TORQUE_WITH_TOLERANCES
from planner.constraints.rms_torque import RmsTorque, bound_rms_torque
from planner.dynamics import SegmentDynamics
from planner.kinematics.forward import JointStates
from planner.plans.result import Plan
from planner.robots.varying.torque_curves import TorqueCurve
from planner.spatial import FloatArray
from planner.trajectories.polynomials import SegmentedPolynomial
from planner.trajectories.reversals import cut_at_reversals, directions
from tests.planner.problems_of_tests import ALL_BACK_ENDS, BACK_END_NAMES
from tests.sizes import NAME

BACK_ENDS = [
    pytest.param(backend, marks=pytest.mark.large_only) if isinstance(backend, planner.MinEffort) else backend
    for backend in ALL_BACK_ENDS
]
"""All back ends; `min_effort` takes ten seconds."""

SAMPLES = {"quick": 20_000, "large": 100_000, "soak": 100_000}[NAME]
"""Samples of each plan."""

GRAVITY_SHARE = 0.85
"""Share of a torque limit that gravity and Coulomb friction take at most."""

SHARES = (0.05, 0.12)
"""Largest shares of a torque limit that Coulomb friction takes, and viscous friction at full speed."""


def robot_of(seed: int) -> planner.Robot:
    """Return an arm with random friction and rotors, one joint without friction."""
    arm, drives = planner.load_robot("ur5e"), np.random.default_rng(seed).uniform(0.2, 1.0, (3, 6))
    drives[:2, seed % 6] = 0.0
    return replace(
        arm,
        joints=tuple(
            replace(
                joint,
                friction=SHARES[0] * joint.torque * c,
                damping=SHARES[1] * joint.torque / joint.velocity * d,
                rotor_inertia=r,
            )
            for joint, c, d, r in zip(arm.joints, *drives.tolist(), strict=True)
        ),
    )


def waypoints_of(seed: int) -> list[planner.JointWaypoint]:
    """Return positions that some joints pass, at which some reverse, and at which one rests all the time."""
    positions = np.random.default_rng(seed).uniform(-1.0, 1.0, (4, 6)) + np.array([0.0, -1.2, 1.2, 0.0, 0.5, 0.0])
    positions[:, (seed + 1) % 6] = positions[0, (seed + 1) % 6]
    kinds = (planner.StopTransition(), planner.ThroughTransition(), planner.StopTransition(), planner.StopTransition())
    return [planner.JointWaypoint(q, transition=kind) for q, kind in zip(positions, kinds, strict=True)]


def scale_of(robot: planner.Robot, seed: int) -> float:
    """Return a factor on torque limits of which gravity and Coulomb friction take most."""
    free = planner.plan(PlanningProblem(planner.load_robot("ur5e"), waypoints_of(seed)), planner.Quintic())
    q = free.trajectory(np.linspace(0.0, free.trajectory.duration, 500))
    coulomb = np.array([joint.friction for joint in robot.joints])
    held = np.abs(planner.inverse_dynamics(robot, q, 0.0 * q, 0.0 * q)) + coulomb
    return float((held / robot.limit("torque")).max() / GRAVITY_SHARE)


def torques(made: Plan, robot: planner.Robot) -> FloatArray:
    """Return the torques (N, joints), N m, at dense times and just inside both ends of each piece."""
    trajectory = made.trajectory
    inside = trajectory.breakpoints[:-1, None] + trajectory.lengths[:, None] * np.array([1e-6, 1.0 - 1e-6])
    times = np.concatenate([np.linspace(0.0, trajectory.duration, SAMPLES)[1:-1], inside.ravel()])
    return planner.inverse_dynamics(robot, *trajectory.evaluate(times, [0, 1, 2]))


@pytest.mark.sized
@pytest.mark.parametrize("seed", range({"quick": 1, "large": 5, "soak": 40}[NAME]))
@pytest.mark.parametrize("backend", BACK_ENDS, ids=BACK_END_NAMES)
def test_every_back_end_keeps_torque_limits_with_friction(backend: planner.BackEnd, seed: int) -> None:
    robot, arm = robot_of(seed), planner.load_robot("ur5e")
    scale = scale_of(robot, seed)
    problem = PlanningProblem(robot, waypoints_of(seed), limits=Limits(torque_scale=scale))
    made = planner.plan(problem, backend)
    used = np.abs(torques(made, robot) / (scale * robot.limit("torque"))).max()
    (check,) = (check for check in made.certificate.checks if check.quantity == "torque")
    assert check.method == "bounded" and check.satisfied and check.ratio is not None and check.lower is not None
    assert used <= check.ratio * (1.0 + 1e-10) and check.ratio <= used * (1.0 + 1e-3)
    assert check.lower <= check.peak <= check.lower * (1.0 + 1e-5)
    free = planner.plan(replace(problem, robot=arm), backend)
    assert made.trajectory.duration >= free.trajectory.duration * (1.0 - 1e-3)
    exceeded = np.abs(torques(free, robot) / (scale * robot.limit("torque"))).max()
    assert exceeded > 1.0 + 1e-3, "friction matters"


def test_samples_of_torques_are_within_the_bound_where_joints_stop() -> None:
    """The friction at the instant of a start or stop is that of the motion."""
    robot = robot_of(1)
    made = planner.plan(PlanningProblem(robot, waypoints_of(1), limits=Limits(torque_scale=0.55)), planner.Toppra())
    (check,) = (check for check in made.certificate.checks if check.quantity == "torque")
    sampled = made.samples(1e-3, ["torque"]).torque
    assert sampled is not None and check.ratio is not None
    assert np.abs(sampled / (0.55 * robot.limit("torque"))).max() <= check.ratio * (1.0 + 1e-10)
    just_after = planner.inverse_dynamics(robot, *made.trajectory.evaluate(np.array([1e-7]), [0, 1, 2]))[0]
    np.testing.assert_allclose(sampled[0], just_after, atol=1e-3)


@pytest.mark.parametrize("backend", [planner.Ruckig(), planner.Toppra()], ids=["ruckig", "toppra"])
def test_lines_of_the_tool_keep_torque_limits_with_friction(backend: planner.BackEnd) -> None:
    """Joints reverse within the lines, which are blended; friction costs time."""
    robot, arm, scale = robot_of(1), planner.load_robot("ur5e"), 0.4
    start = np.array([0.3, -0.9, 1.9, -1.0, 0.3, 0.0])
    pose = planner.forward_kinematics(arm, start)
    places = [pose.position + offset for offset in ([0.0, 0.0, 0.2], [-0.2, 0.1, 0.1], [0.0, 0.0, 0.0])]
    kinds = (planner.BlendTransition(0.05), planner.BlendTransition(0.05), planner.StopTransition())
    line = planner.LinearMotion()
    ends = [
        planner.PoseWaypoint(planner.Pose(place, pose.rotation), motion=line, transition=kind)
        for place, kind in zip(places, kinds, strict=True)
    ]
    problem = PlanningProblem(robot, [planner.JointWaypoint(start), *ends], limits=Limits(torque_scale=scale))
    made, free = (planner.plan(replace(problem, robot=own), backend) for own in (robot, arm))
    velocities = made.trajectory(np.linspace(0.0, made.trajectory.duration, 500), 1)
    assert ((velocities.min(axis=0) < -0.1) & (velocities.max(axis=0) > 0.1)).any()
    used = np.abs(torques(made, robot) / (scale * robot.limit("torque"))).max()
    assert 0.99 < used <= 1.0 + 1e-9 and made.trajectory.duration > free.trajectory.duration
    stop = planner.stop_on_path(robot, made.trajectory, 0.3 * made.trajectory.duration, limits=problem.limits)
    states = stop.trajectory.evaluate(np.linspace(0.0, stop.trajectory.duration, SAMPLES)[1:-1], [0, 1, 2])
    assert stop.certificate.satisfied
    assert (np.abs(planner.inverse_dynamics(robot, *states)) <= scale * robot.limit("torque") * (1.0 + 1e-9)).all()


@pytest.mark.large_only
def test_slower_motions_keep_the_limits_too() -> None:
    robot, scale = robot_of(2), 0.55
    problem = PlanningProblem(robot, waypoints_of(2), limits=Limits(torque_scale=scale))
    fastest = planner.plan(problem, planner.Ruckig()).trajectory.duration
    for factor in (1.05, 1.5, 4.0):
        longer = planner.plan(replace(problem, duration=factor * fastest), planner.Ruckig())
        assert (np.abs(torques(longer, robot)) <= scale * robot.limit("torque") * (1.0 + 1e-9)).all()


def test_friction_that_gravity_leaves_no_room_for_is_refused() -> None:
    robot = robot_of(3)
    position, name = np.array(waypoints_of(3)[0].position), robot.joint_names[1]
    held = float(np.abs(planner.inverse_dynamics(robot, position, 0.0 * position, 0.0 * position))[1])
    rough = robot.derived(id="rough", limits={name: {"friction": 0.5 * held}})
    lifted = position - [0.0, 0.2, 0.0, 0.0, 0.0, 0.0]
    limits = Limits(torque=(100.0, 1.3 * held, 100.0, 20.0, 20.0, 20.0))
    problem = PlanningProblem(rough, [position, lifted], limits=limits)
    for backend in ALL_BACK_ENDS:
        with pytest.raises(planner.LimitsUnsatisfiable, match="gravity with friction requires") as refusal:
            planner.plan(problem, backend)
        remedy = refusal.value.remedies[0]
        assert remedy.field[:2] == ("limits", "torque") and remedy.value > 1.5 * held


def _with_curves(robot: planner.Robot) -> planner.Robot:
    curves = [TorqueCurve((0.0, 0.5, 3.0), (joint.torque, joint.torque, 0.3 * joint.torque)) for joint in robot.joints]
    joints = (replace(joint, torque_curve=curve) for joint, curve in zip(robot.joints, curves, strict=True))
    return replace(robot, joints=tuple(joints))


@pytest.mark.long_table
@pytest.mark.parametrize("constraint", [TORQUE, POWER, TORQUE_AT_SPEED, TORQUE_WITH_TOLERANCES])
def test_factors_are_those_at_which_a_slower_motion_reaches_its_limit(constraint: object) -> None:
    """Bisection among paces finds the same first excess; with payload tolerances, a factor is never too small."""
    robot = _with_curves(robot_of(4))
    if constraint is TORQUE_WITH_TOLERANCES:
        robot = robot.with_payload(planner.Payload(1.0, (0.0, 0.0, 0.1), mass_tolerance=0.5, inertia_tolerance=0.1))
    own = next(each for each in (TORQUE, POWER, TORQUE_AT_SPEED, TORQUE_WITH_TOLERANCES) if each is constraint)
    q, v, a = np.random.default_rng(5).uniform(-2.0, 2.0, (3, 40, 6))
    resting = np.abs(own.values(JointStates(robot, q, np.sign(v) * 2e-9, np.zeros_like(q), a)))
    limits = 1.2 * resting + 0.3 * np.abs(own.values(JointStates(robot, q, v, a, a)))
    middle = np.zeros_like(limits) if own is not TORQUE else 0.05 * limits
    factors = own.factors(JointStates(robot, q, v, a, a), limits, middle)
    paces = np.linspace(1e-3, 3.0, 400)

    def excess(pace: float, row: int, column: int) -> float:
        at = JointStates(robot, q[[row]], pace * v[[row]], pace**2 * a[[row]], a[[row]])
        return float(abs(own.values(at)[0, column] - middle[row, column]) - limits[row, column])

    for row, column in np.random.default_rng(6).integers(0, (40, 6), (10, 2)).tolist():
        values = [excess(pace, row, column) for pace in paces]
        above = next((pair for pair in pairwise(range(400)) if values[pair[1]] > 0.0), None)
        if above is None:
            assert factors[row, column] < 1.0 / 2.9
            continue
        first = brentq(excess, *paces[list(above)], args=(row, column))
        if own is TORQUE_WITH_TOLERANCES:
            assert 1.0 / first - 1e-6 <= factors[row, column] <= 1.3 / first
        else:
            assert factors[row, column] == pytest.approx(1.0 / first, rel=1e-6)


def test_rms_torques_are_bounded_and_kept_with_friction() -> None:
    robot = robot_of(6)
    free = planner.plan(PlanningProblem(robot, waypoints_of(6)), planner.Ruckig())
    lower, upper = bound_rms_torque(SegmentDynamics.unchanged(robot), free.trajectory, RmsTorque(np.full(6, 50.0)))
    times = (np.arange(200_000) + 0.5) / 200_000 * free.trajectory.duration
    values = planner.inverse_dynamics(robot, *free.trajectory.evaluate(times, [0, 1, 2]))
    rms = np.sqrt((values**2).mean(axis=0))
    np.testing.assert_allclose(lower, rms, rtol=1e-4)
    np.testing.assert_allclose(upper, rms, rtol=1e-4)
    held = np.abs(planner.inverse_dynamics(robot, free.trajectory(times, 0), 0 * values, 0 * values)).max(axis=0)
    coulomb = np.array([joint.friction for joint in robot.joints])
    limits = Limits(rms_torque=tuple(np.maximum(held + coulomb, 0.97 * rms).tolist()))
    made = planner.plan(PlanningProblem(robot, waypoints_of(6), limits=limits), planner.Ruckig())
    (check,) = (check for check in made.certificate.checks if check.quantity == "rms_torque")
    assert check.satisfied


def test_the_heaviest_payload_counts_friction() -> None:
    arm, rough = (replace(robot, rated_payload=None) for robot in (planner.load_robot("ur5e"), robot_of(7)))
    made = planner.plan(PlanningProblem(arm, waypoints_of(7)), planner.Quintic())
    loads = [planner.max_payload(robot, made.trajectory) for robot in (arm, rough)]
    assert loads[0].mass is not None and loads[1].mass is not None and loads[1].mass < loads[0].mass
    used = np.abs(torques(made, rough.with_payload(planner.Payload(loads[1].mass))) / arm.limit("torque")).max()
    assert used == pytest.approx(1.0, abs=1e-3)


def test_motions_are_cut_where_joints_reverse() -> None:
    rng = np.random.default_rng(9)
    motion = SegmentedPolynomial(rng.uniform(0.2, 2.0, 30), rng.normal(size=(30, 3, 6)), np.arange(30))
    counted = np.array([True, False, True])
    cut, of = cut_at_reversals(motion, counted)
    assert len(cut.lengths) > 30 and (motion.segments[of] == cut.segments).all()
    np.testing.assert_allclose(np.bincount(of, cut.lengths), motion.lengths)
    at = np.linspace(1e-6, 1.0 - 1e-6, 101)[:, None] * cut.lengths
    rows = np.arange(len(cut.lengths))
    for share in at:
        (velocity,) = cut.evaluate_on(rows, share, [1])
        moves = np.abs(velocity) > 1e-7
        assert (np.sign(velocity) == directions(cut))[:, counted][moves[:, counted]].all()
    times = rng.uniform(0.0, motion.breakpoints[-1], 200)
    np.testing.assert_allclose(cut.evaluate(times)[0], motion.evaluate(times)[0], atol=1e-9)
