"""Following errors and friction tolerances against Pinocchio at drawn actual positions and with drawn friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.backends import BACKENDS
from planner.certificate import Check, certify
from planner.constraints import TOOL, TORQUE_WITH_TOLERANCES
from planner.errors import Collision, InvalidProblem, InvalidRobotModel, LimitsUnsatisfiable, PlanningError
from planner.kinematics.forward import CENTRIPETAL, JointStates
from planner.limits import Limits
from planner.operations import kept_clear
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.robots import DHJoint, Robot, load_robot
from planner.robots.payload import Payload
from planner.scene import Scene, SceneObject
from planner.scene.checker import CollisionChecker
from planner.shapes import Box
from planner.spatial import FloatArray, Pose
from planner.speed_zones import SpeedZone
from planner.trajectories.trajectory import Trajectory
from tests.planner.kernels.arms import random_states, robots
from tests.planner.problems_of_tests import backend_of

NAME = TORQUE_WITH_TOLERANCES.name
CARRIED = Payload(4.0, (0.05, -0.02, 0.1), (0.02, 0.03, 0.01))
KUKA = replace(load_robot("kuka_kr16_2"), rated_payload=None)
WEAK = KUKA.derived(limits={joint.name: {"torque": 0.16 * joint.torque} for joint in KUKA.joints})
WAYPOINTS = [(0.0, -1.4, 1.5, 0.0, 0.6, 0.0), (0.6, -0.9, 1.2, 0.4, 0.9, 0.5), (0.2, -1.2, 1.4, 0.1, 0.5, 0.1)]
ERROR = 2e-3
TOOL_LIMITS = {
    "tcp_linear_velocity": 0.4,
    "tcp_angular_velocity": 0.8,
    "tcp_linear_acceleration": 1.5,
    "tcp_angular_acceleration": 3.0,
}


def with_errors(robot: Robot, size: float, seed: int = 0) -> Robot:
    """Return a robot with following errors up to a size, one of them none."""
    errors = size * np.random.default_rng(seed).uniform(0.3, 1.0, robot.dof)
    errors[-1] = 0.0
    return robot.derived(limits={j.name: {"following_error": e} for j, e in zip(robot.joints, errors, strict=True)})


def with_friction(robot: Robot) -> Robot:
    """Return a robot with friction within tolerances, of which the torque limits leave room."""
    return robot.derived(
        limits={
            joint.name: {
                "friction": 0.02 * joint.torque,
                "damping": 0.02 * joint.torque / joint.velocity,
                "friction_tolerance": 0.01 * joint.torque,
                "damping_tolerance": 0.01 * joint.torque / joint.velocity,
            }
            for joint in robot.joints
        }
    )


def offsets(robot: Robot, count: int) -> FloatArray:
    """Draw distances (count, joints) of actual positions from planned ones: corners of the box, and inside."""
    rng = np.random.default_rng(count)
    inside = rng.uniform(-1.0, 1.0, (count, robot.dof))
    inside[::2] = np.sign(inside[::2])
    return inside * np.array([joint.following_error for joint in robot.joints])


def largest_torques(robot: Robot, states: FloatArray, count: int) -> FloatArray:
    """Return the largest magnitudes (N, joints) of Pinocchio's torques at drawn actual positions, without drives."""
    data, most = robot.model.createData(), np.zeros(states.shape[1:])
    for away in offsets(robot, count):
        found = [pin.rnea(robot.model, data, q + away, v, a) for q, v, a in states.transpose(1, 0, 2)]
        most = np.maximum(most, np.abs(found))
    return most


def dense_states(trajectory: Trajectory, times: int) -> FloatArray:
    return np.array(trajectory.evaluate(np.linspace(0.0, trajectory.duration, times), [0, 1, 2]))


def check_of(made: Plan | Robot, name: str = NAME, trajectory: Trajectory | None = None) -> Check:
    certificate = certify(made, trajectory) if trajectory is not None else made.certificate
    (check,) = (check for check in certificate.checks if check.quantity == name)
    return check


@pytest.mark.long_table
@pytest.mark.parametrize("name", robots())
def test_the_values_bound_the_torques_at_all_actual_positions(name: str) -> None:
    robot = robots()[name]
    robot = with_errors(robot if robot.has_dynamics else robot.with_payload(CARRIED), ERROR)
    states = random_states(robot, 40, 1.0)
    largest = largest_torques(robot, states, 300)
    found = np.abs(TORQUE_WITH_TOLERANCES.values(JointStates(robot, *states)))
    assert (found >= largest).all()
    assert found == pytest.approx(largest, abs=0.01 * largest.max())


def test_the_values_bound_payload_tolerances_at_all_actual_positions() -> None:
    payload = replace(CARRIED, mass_tolerance=1.0, center_of_mass_tolerance=(0.02, 0.03, 0.01), inertia_tolerance=0.2)
    robot = with_errors(KUKA, ERROR)
    states, rng = random_states(robot, 30, 1.0), np.random.default_rng(4)
    most = np.zeros(states.shape[1:])
    for _ in range(100):
        side = np.sign(rng.normal(size=7))
        center = np.array(payload.center_of_mass) + side[1:4] * payload.center_of_mass_tolerance
        moments = np.array(payload.inertia) * (1.0 + side[4:] * payload.inertia_tolerance)
        body = Payload(payload.mass + side[0], tuple(center.tolist()), tuple(moments.tolist()))
        most = np.maximum(most, largest_torques(robot.with_payload(body), states, 6))
    found = np.abs(TORQUE_WITH_TOLERANCES.values(JointStates(robot.with_payload(payload), *states)))
    assert (found >= most).all()
    assert found == pytest.approx(most, abs=0.02 * most.max())


@pytest.mark.parametrize("name", ["loaded", "on a wall", "on a rail", "slides"])
def test_the_certificate_bounds_all_actual_positions_at_all_times(name: str) -> None:
    robot = replace(robots()[name], rated_payload=None)
    if not robot.has_dynamics:
        limits = {joint.name: {"torque": 100.0} for joint in robot.joints}
        robot = robot.with_payload(CARRIED).derived(limits=limits)
    robot = with_errors(robot, ERROR)
    rng = np.random.default_rng(5)
    drawn = np.clip(robot.middle + rng.uniform(-0.4, 0.4, (3, robot.dof)), robot.limit("lower"), robot.limit("upper"))
    ends = [JointWaypoint(tuple(position)) for position in drawn.tolist()]
    trajectory = plan(PlanningProblem(robot, ends), "quintic").trajectory
    check = check_of(robot, trajectory=trajectory)
    true = largest_torques(robot, dense_states(trajectory, 200), 100) / robot.limit("torque")
    assert check.method == "bounded"
    assert check.ratio is not None
    assert check.lower is not None
    assert check.limit is not None
    assert true.max() <= check.ratio
    assert check.ratio == pytest.approx(true.max(), rel=0.01)
    assert check.lower <= true.max() * check.limit * (1.0 + 1e-4)


@pytest.mark.long_table
@pytest.mark.parametrize("kind", BACKENDS)
def test_every_back_end_keeps_torque_limits_at_all_actual_positions(kind: str) -> None:
    robot = with_errors(WEAK, ERROR)
    made = plan(PlanningProblem(robot, [JointWaypoint(q) for q in WAYPOINTS], payload=CARRIED), backend_of(kind))
    loaded = robot.with_payload(CARRIED)
    true = largest_torques(loaded, dense_states(made.trajectory, 200), 100) / robot.limit("torque")
    check = check_of(made)
    assert check.satisfied
    assert check.ratio is not None
    assert true.max() <= check.ratio <= 1.0 + 1e-9
    assert true.max() == pytest.approx(1.0, rel=0.03)


@pytest.mark.long_table
@pytest.mark.parametrize("kind", BACKENDS)
def test_every_back_end_keeps_torque_limits_with_all_friction(kind: str) -> None:
    robot = with_friction(KUKA).derived(limits={j.name: {"torque": 0.16 * j.torque} for j in KUKA.joints})
    waypoints = [JointWaypoint(q) for q in WAYPOINTS[: 2 if kind == "min_effort" else 3]]
    made = plan(PlanningProblem(robot, waypoints), backend_of(kind))
    check = check_of(made)
    assert check.satisfied
    assert check.ratio is not None
    states = dense_states(made.trajectory, 1001)[:, 1:-1]
    data, rng, worst = robot.model.createData(), np.random.default_rng(1), 0.0
    smooth = np.array([pin.rnea(robot.model, data, *state) for state in states.transpose(1, 0, 2)])
    given = np.array([(j.friction, j.damping) for j in robot.joints]).T
    within = np.array([(j.friction_tolerance, j.damping_tolerance) for j in robot.joints]).T
    for k in range(1000):
        share = rng.uniform(-1.0, 1.0, within.shape)
        coulomb, viscous = given + within * (np.sign(share) if k % 2 else share)
        torques = smooth + coulomb * np.sign(states[1]) + viscous * states[1]
        worst = max(worst, float((np.abs(torques) / robot.limit("torque")).max()))
    assert worst <= check.ratio * (1.0 + 1e-9) <= 1.0 + 2e-9
    assert worst == pytest.approx(check.ratio, rel=0.01)
    assert check.ratio == pytest.approx(1.0, rel=0.06 if kind == "min_effort" else 2e-3)


def tool_rates(robot: Robot, states: FloatArray) -> dict[str, FloatArray]:
    """Return Pinocchio's magnitudes of the tool's velocities and accelerations at states (3, N, joints)."""
    model, data, frame = robot.model, robot.model.createData(), robot.tool_frame_id
    rows = []
    for q, v, a in states.transpose(1, 0, 2):
        pin.forwardKinematics(model, data, q, v, a)
        velocity = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
        acceleration = pin.getFrameClassicalAcceleration(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
        rows.append([np.linalg.norm(part) for part in (*_parts(velocity), *_parts(acceleration))])
    return dict(zip(TOOL_LIMITS, np.array(rows).T, strict=True))


def _parts(motion: pin.Motion) -> tuple[FloatArray, FloatArray]:
    return motion.linear, motion.angular


@pytest.mark.parametrize("name", robots())
def test_the_values_of_the_tool_bound_all_actual_positions(name: str) -> None:
    robot = with_errors(robots()[name], ERROR)
    states = random_states(robot, 30, 1.0)
    values = {quantity: TOOL[quantity].values(JointStates(robot, *states))[:, 0] for quantity in TOOL_LIMITS}
    for away in offsets(robot, 100):
        actual = states + np.array([away, 0.0 * away, 0.0 * away])[:, None]
        for quantity, most in tool_rates(robot, actual).items():
            assert (most <= values[quantity] * (1.0 + 1e-12)).all()
    nominal = tool_rates(robot, states)
    for quantity, most in values.items():
        assert most == pytest.approx(nominal[quantity], abs=0.1 * most.max())


def test_the_values_of_the_tools_jerk_bound_all_actual_positions() -> None:
    for robot in map(with_errors, robots().values(), [ERROR] * len(robots())):
        states = np.vstack([random_states(robot, 30, 1.0), random_states(robot, 31, 1.0)[:1, :30]])
        exact = robot.derived(limits={name: {"following_error": 0.0} for name in robot.joint_names})
        for quantity in ("tcp_linear_jerk", "tcp_angular_jerk"):
            most = TOOL[quantity].values(JointStates(robot, *states))
            for away in offsets(robot, 50):
                actual = JointStates(exact, states[0] + away, *states[1:])
                assert (TOOL[quantity].values(actual) <= most).all()


@pytest.mark.long_table
@pytest.mark.parametrize("kind", BACKENDS)
def test_every_back_end_keeps_limits_of_the_tool_at_all_actual_positions(kind: str) -> None:
    robot = with_errors(load_robot("ur5e"), ERROR)
    waypoints = [JointWaypoint(q) for q in ((0.0, -1.2, 1.4, -0.4, 1.0, 0.0), (0.8, -0.8, 1.0, 0.2, 1.4, 0.6))]
    for quantity, limit in TOOL_LIMITS.items():
        limits = Limits(**{quantity: limit})
        made = plan(PlanningProblem(robot, waypoints, limits=limits), backend_of(kind))
        check = check_of(made, quantity)
        near = np.clip(check.time + np.linspace(-1e-9, 1e-9, 3), 0.0, made.trajectory.duration)
        times = np.append(near, np.linspace(0.0, made.trajectory.duration, 40))
        states = np.array(made.trajectory.evaluate(times, [0, 1, 2]))
        largest = 0.0
        for away in offsets(robot, 100):
            actual = states + np.array([away, 0.0 * away, 0.0 * away])[:, None]
            largest = max(largest, float(tool_rates(robot, actual)[quantity].max()))
        assert check.satisfied
        assert check.lower is not None
        assert largest <= check.peak <= limit * (1.0 + 1e-9)
        assert check.lower <= largest * (1.0 + 1e-6)
        assert check.peak == pytest.approx(largest, rel=0.04)


def test_position_limits_hold_at_all_actual_positions() -> None:
    robot = with_errors(KUKA, ERROR)
    error = robot.joints[0].following_error
    assert robot.limit("upper")[0] == pytest.approx(KUKA.joints[0].upper - error)
    assert robot.joints[0].upper == KUKA.joints[0].upper
    rest = WAYPOINTS[0][1:]
    plan(PlanningProblem(robot, [JointWaypoint(WAYPOINTS[0]), JointWaypoint((robot.limit("upper")[0], *rest))]))
    with pytest.raises(PlanningError):
        plan(PlanningProblem(robot, [JointWaypoint(WAYPOINTS[0]), JointWaypoint((KUKA.joints[0].upper, *rest))]))


@pytest.mark.large_only
def test_velocity_limits_by_position_hold_at_all_actual_positions() -> None:
    fr3 = load_robot("fr3")
    robot = with_errors(fr3, ERROR)
    conditions = fr3.velocity_conditions
    assert conditions is not None
    upper = robot.limit("upper") - 0.05
    for kind in ("toppra", "ruckig", "quintic"):
        ends = [JointWaypoint(tuple(q)) for q in (robot.middle.tolist(), upper.tolist())]
        made = plan(PlanningProblem(robot, ends), kind)
        states = dense_states(made.trajectory, 2000)
        for away in offsets(robot, 50):
            assert (conditions.shares(states[0] + away, states[1]) <= 1.0 + 1e-9).all()
        assert check_of(made, "velocity_at_position").ratio == pytest.approx(1.0, rel=1e-3)


@pytest.mark.large_only
def test_clearances_hold_at_all_actual_positions() -> None:
    """The margin of 5 mm is that of the actual positions; a detour without following errors breaks it."""
    robot = with_errors(KUKA, 5e-3, 3)
    scene = Scene([SceneObject("block", [Box((0.3, 0.3, 1.0))], Pose(np.array([1.25, 0.0, 0.3])))], margin=0.005)
    ends = [JointWaypoint((-0.7, -0.7, 1.0, 0.0, 0.8, 0.0)), JointWaypoint((0.7, -0.7, 1.0, 0.0, 0.8, 0.0))]
    given = CollisionChecker(KUKA, scene, self_collision=True)
    over = [replace(end, position=(end.position[0], -1.2, 1.0, 0.0, 0.8, 0.0)) for end in ends]
    made = plan(PlanningProblem(robot, over, scene=scene, self_collision=True), "quintic")
    checker = CollisionChecker(robot, scene, self_collision=True)
    states = dense_states(made.trajectory, 40)[0]
    least = np.inf
    for away in offsets(robot, 30):
        placements = given.bodies.at(states + away)
        for pair in np.flatnonzero(np.isfinite(given.margins).ravel()) + given.own_pairs:
            for row in range(0, len(states), 5):
                least = min(least, given.separate(placements, row, int(pair)).distance)
    assert least >= 0.005
    with pytest.raises(Collision):
        plan(PlanningProblem(robot, ends, scene=scene), "quintic")
    assert (checker.margins_of(np.arange(checker.own_pairs)) >= 0.0).all()


@pytest.mark.large_only
def test_displacements_of_pairs_are_bounded_by_their_margins() -> None:
    """At random positions, the distances of all pairs change by no more than the margins grow."""
    robot = with_errors(KUKA, 5e-3, 3)
    scene = Scene([SceneObject("block", [Box((0.3, 0.3, 1.0))], Pose(np.array([1.25, 0.0, 0.3])))])
    checker, given = (CollisionChecker(each, scene, self_collision=True) for each in (robot, KUKA))
    positions = KUKA.middle + np.random.default_rng(1).uniform(-1.0, 1.0, (5, 6))
    pairs = np.concatenate([np.arange(given.own_pairs), np.flatnonzero(np.isfinite(given.margins)) + given.own_pairs])
    grown = checker.margins_of(pairs) - given.margins_of(pairs)
    planned = given.bodies.at(positions)
    shrunk = np.zeros((len(pairs), 5))
    for away in offsets(robot, 20):
        actual = given.bodies.at(positions + away)
        for k, pair in enumerate(pairs.tolist()):
            for row in range(5):
                before, after = (given.separate(places, row, pair).distance for places in (planned, actual))
                shrunk[k, row] = max(shrunk[k, row], before - after)
    assert (shrunk <= grown[:, None] + 1e-6).all()
    assert shrunk.max() > 0.2 * grown.max()


def test_limits_that_hold_for_planned_positions_alone_have_a_warning() -> None:
    robot = with_errors(KUKA, ERROR)
    start = JointWaypoint(WAYPOINTS[0])
    goal = PoseWaypoint(Pose(np.array([1.3, 0.2, 0.9])), motion=LinearMotion())
    made = plan(PlanningProblem(robot, [start, goal]), "quintic")
    (warning,) = (each for each in made.warnings if each.code == "following_error_not_covered")
    assert "path_position_deviation" in warning.message
    joints_only = plan(PlanningProblem(robot, [JointWaypoint(q) for q in WAYPOINTS]), "quintic")
    assert "following_error_not_covered" not in [each.code for each in joints_only.warnings]


def test_an_operation_warns_of_limits_without_the_tolerances_of_payload_and_friction() -> None:
    made = plan(PlanningProblem(KUKA, [JointWaypoint(q) for q in WAYPOINTS]), "quintic")
    loose = KUKA.derived(limits={name: {"friction": 2.0, "friction_tolerance": 1.0} for name in KUKA.joint_names})
    vague = KUKA.with_payload(planner.Payload(mass=1.0, mass_tolerance=0.5))
    named = Limits(total_power=1e6, rms_torque=(1e6,) * KUKA.dof)
    for robot, word, limits, names in (
        (loose, "friction", named, {"total_power", "rms_torque"}),
        (vague, "payload", Limits(power=(1e6,) * KUKA.dof), {"power"}),
        (loose, "friction", Limits(), set()),
        (KUKA, "", named, set()),
    ):
        reversed_ = planner.reverse_trajectory(robot, made.trajectory, limits=limits)
        found = [each.message for each in reversed_.warnings if each.code == "tolerances_not_covered"]
        assert len(found) == bool(names)
        assert all(name in message for name in (*names, word) for message in found)


def test_an_operation_on_a_trajectory_warns_of_them_too() -> None:
    made = plan(PlanningProblem(KUKA, [JointWaypoint(q) for q in WAYPOINTS]), "quintic")
    limits = Limits(tcp_centripetal_acceleration=1e3)
    reversed_ = planner.reverse_trajectory(with_errors(KUKA, ERROR), made.trajectory, limits=limits)
    (warning,) = (each for each in reversed_.warnings if each.code == "following_error_not_covered")
    assert "tcp_centripetal_acceleration" in warning.message
    scene = Scene([SceneObject("wall", [Box([0.1, 1.0, 1.0])], Pose([4.0, 0.0, 0.0]))])
    for clear in (kept_clear(reversed_, scene), kept_clear(reversed_, scene, speed_zones=[SpeedZone(0.1, 1.0)])):
        (warning,) = (each for each in clear.warnings if each.code == "following_error_not_covered")
        assert "tcp_centripetal_acceleration" in warning.message
        assert ("speed_zones" in warning.message) == bool(clear.certificate.speed_zones)
    without = planner.reverse_trajectory(KUKA, made.trajectory, limits=limits)
    assert "following_error_not_covered" not in [each.code for each in without.warnings]


def test_limits_without_a_bound_are_refused() -> None:
    waypoints = [JointWaypoint(q) for q in WAYPOINTS]
    with_error, rough = with_errors(KUKA, ERROR), with_friction(KUKA)
    refused = [(with_error, Limits(**{CENTRIPETAL: 1.0}))]
    refused += [(each, Limits(total_power=1e4)) for each in (with_error, rough)]
    for robot, limits in refused:
        with pytest.raises(InvalidProblem, match="do not count in it"):
            plan(PlanningProblem(robot, waypoints, limits=limits))


def test_torques_at_rest_beyond_the_limit_are_refused() -> None:
    weaker = WEAK.derived(limits={joint.name: {"torque": 0.68 * joint.torque} for joint in WEAK.joints})
    waypoints = [JointWaypoint(q) for q in WAYPOINTS]
    for kind in ("toppra", "quintic"):
        plan(PlanningProblem(weaker, waypoints), kind)
        with pytest.raises(LimitsUnsatisfiable, match="following errors"):
            plan(PlanningProblem(with_errors(weaker, 0.05), waypoints), kind)


def test_faults_of_tolerances() -> None:
    for values in ({"friction_tolerance": 1.0}, {"following_error": 0.2}, {"following_error": -1e-3}):
        with pytest.raises(InvalidRobotModel):
            KUKA.derived(limits={KUKA.joint_names[0]: values})
    rows = [DHJoint("prismatic", d=0.1, mass=2.0, following_error=1e-3, lower=0.0, upper=1.0), DHJoint("revolute")]
    robot = Robot.from_dh(rows)
    assert robot.joints[0].following_error == 1e-3
    with pytest.raises(InvalidRobotModel, match="position limits"):
        Robot.from_dh([replace(rows[0], lower=None, upper=None), rows[1]])


def test_without_them_the_plan_is_the_same() -> None:
    zeros = KUKA.derived(limits={name: {"following_error": 0.0} for name in KUKA.joint_names})
    waypoints = [JointWaypoint(q) for q in WAYPOINTS]
    one, other = (plan(PlanningProblem(robot, waypoints), "toppra") for robot in (KUKA, zeros))
    assert (one.trajectory.coefficients == other.trajectory.coefficients).all()
    assert NAME not in [check.quantity for check in other.certificate.checks]
