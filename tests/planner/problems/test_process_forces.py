"""Process forces against Pinocchio's torques with an external force, which has its own code."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from planner.backends import BACKENDS
from planner.dynamics import inverse_dynamics, path_dynamics
from planner.dynamics.symbolic import dynamics_content, symbolic_motion
from planner.errors import InvalidProblem, LimitsUnsatisfiable
from planner.limits import Limits
from planner.planning import plan
from planner.problems.motion_around import FreeMotion
from planner.problems.moves import CartesianMove
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, RelativeWaypoint
from planner.problems.transitions import ThroughTransition
from planner.proofs import check_proof, write_proof
from planner.robots import Robot, load_robot
from planner.robots.payload import Payload, ProcessForce
from planner.spatial import Pose, rotation_x
from tests.planner.kernels.arms import random_states, robots
from tests.planner.problems_of_tests import backend_of

TOOL = Pose.from_rpy([0.1, -0.05, 0.25], [0.3, 0.6, -0.4])
FORCES = [
    ProcessForce((20.0, -35.0, 240.0), (3.0, 1.0, -8.0)),
    ProcessForce((20.0, -35.0, 240.0), (3.0, 1.0, -8.0), "base"),
]
ARM = load_robot("kuka_kr16_l6_2").with_tool(Pose.from_rpy([0.0, 0.0, 0.2], [0.0, 0.3, 0.0]))
HOME, ABOVE = (0.0, -1.4, 1.5, 0.0, 0.6, 0.0), (0.8, -0.9, 1.3, 0.2, 0.5, 0.3)
DRILL = ProcessForce((0.0, 0.0, 400.0), (0.0, 0.0, 12.0))


def torques(robot: Robot, force: ProcessForce | None, states: np.ndarray) -> np.ndarray:
    """Return torques (N, joints) at states (3, N, joints): the workpiece pushes back with the opposite force."""
    model, data, tool = robot.model, robot.data, robot.model.frames[robot.tool_frame_id]
    rows = []
    for q, v, a in states.transpose(1, 0, 2):
        pin.forwardKinematics(model, data, q)
        pushes = [pin.Force.Zero() for _ in range(model.njoints)]
        if force is not None:
            vectors = np.array([force.force, force.moment])
            if force.frame == "base":
                vectors = vectors @ (data.oMi[tool.parentJoint] * tool.placement).rotation
            pushes[tool.parentJoint] = tool.placement.act(pin.Force(*-vectors))
        rows.append(pin.rnea(model, data, q, v, a, pushes).copy())
    return np.array(rows)


@pytest.mark.parametrize("force", FORCES, ids=lambda force: force.frame)
@pytest.mark.parametrize("name", robots())
def test_torques_and_path_dynamics_have_the_force(name: str, force: ProcessForce) -> None:
    robot = robots()[name].with_tool(TOOL)
    states = random_states(robot, 23)
    pushing = replace(robot, process_force=force)
    expected = torques(robot, force, states)
    size = np.abs(expected).max()
    assert inverse_dynamics(pushing, *states) == pytest.approx(expected, abs=1e-12 * size)
    still = np.zeros_like(states[0])
    held = torques(robot, force, np.array([states[0], still, still]))
    found = path_dynamics(pushing, *states)
    assert found.gravity == pytest.approx(held, abs=1e-12 * size)
    moved = torques(robot, None, np.array([states[0], states[1], states[2]]))
    assert found.centripetal + found.gravity == pytest.approx(
        moved - torques(robot, None, np.array([states[0], still, still])) + held, abs=1e-12 * size
    )


def test_the_torques_of_a_force_are_the_work_it_does() -> None:
    """J^T F follows from central differences of the tool's position, without any Jacobian."""
    q, step, force = np.array(ABOVE), 1e-6, np.array(FORCES[1].force)
    pushing = replace(ARM, process_force=ProcessForce(FORCES[1].force, frame="base"))
    still = np.zeros(ARM.dof)

    def tool(at: np.ndarray) -> np.ndarray:
        pin.framesForwardKinematics(ARM.model, ARM.data, at)
        return np.array(ARM.data.oMf[ARM.tool_frame_id].translation)

    moves = [(tool(q + step * row) - tool(q - step * row)) / (2.0 * step) for row in np.eye(ARM.dof)]
    added = inverse_dynamics(pushing, q, still, still) - inverse_dynamics(ARM, q, still, still)
    assert added == pytest.approx(np.array(moves) @ force, abs=1e-6)


@pytest.mark.parametrize("force", FORCES, ids=lambda force: force.frame)
def test_the_expression_has_the_force(force: ProcessForce) -> None:
    pushing = replace(robots()["slides"].with_payload(Payload(2.0)).with_tool(TOOL), process_force=force)
    q, v, a = random_states(pushing, 12)
    symbols = [ca.SX.sym(name, pushing.dof) for name in "qva"]
    motion = ca.Function("motion", symbols, [symbolic_motion(pushing, *symbols).torques]).map(len(q))
    found, expected = np.array(motion(q.T, v.T, a.T)).T, torques(pushing, force, np.array([q, v, a]))
    assert found == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())
    contents = [dynamics_content(each) for each in (pushing, replace(pushing, process_force=None))]
    assert contents[0] != contents[1]


def test_a_force_in_a_frame_is_turned_to_the_axes_of_the_base() -> None:
    given = ProcessForce((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
    turned = given.from_frame(Pose(np.ones(3), rotation_x(np.pi / 2.0)))
    assert turned.frame == "base"
    assert turned.force == pytest.approx((1.0, -3.0, 2.0))
    assert turned.moment == pytest.approx((4.0, -6.0, 5.0))


def drilling(limits: Limits, force: ProcessForce | None = DRILL) -> PlanningProblem:
    """Make a motion from home above a hole, 0.1 m into it with the force, back without it, and home."""
    steps = [
        RelativeWaypoint(move=CartesianMove((0.0, 0.0, z)), frame="tool", motion=LinearMotion(), process_force=own)
        for z, own in ((0.1, force), (-0.1, None))
    ]
    return PlanningProblem(ARM, [HOME, ABOVE, *steps, JointWaypoint(HOME)], limits)


@pytest.mark.long_table
@pytest.mark.parametrize("kind", BACKENDS)
def test_every_back_end_keeps_torque_limits_with_the_force(kind: str) -> None:
    """The motion with the force needs the whole limits, and a plan without it breaks them."""
    free = Limits(acceleration_scale=0.3)
    slow = plan(drilling(free), backend_of(kind))
    on = slow.trajectory
    times = np.linspace(on.departures[2 - 1] + 1e-9, on.arrivals[2] - 1e-9, 2000)
    states = np.array(on.evaluate(times, [0, 1, 2]))
    still = np.zeros_like(states[0])
    held = np.abs(torques(ARM, DRILL, np.array([states[0], still, still]))).max(axis=0)
    moved = np.abs(torques(ARM, DRILL, states)).max(axis=0)
    limit = np.minimum(np.maximum(held + 0.3 * (moved - held), 0.3 * ARM.limit("torque")), ARM.limit("torque"))
    planned = plan(drilling(replace(free, torque=tuple(limit.tolist()))), backend_of(kind))
    on, worst = planned.trajectory, 0.0
    for segment in range(4):
        times = np.linspace(on.departures[segment] + 1e-9, on.arrivals[segment + 1] - 1e-9, 1000)
        used = torques(ARM, DRILL if segment == 1 else None, np.array(on.evaluate(times, [0, 1, 2])))
        worst = max(worst, float((np.abs(used) / limit).max()))
        rows = planned.samples(0.01, ["torque"])
        assert rows.torque is not None
        of = np.flatnonzero(rows.segment == segment)[1:-1]
        expected = torques(
            ARM, DRILL if segment == 1 else None, np.array([rows.position, rows.velocity, rows.acceleration])[:, of]
        )
        assert rows.torque[of] == pytest.approx(expected, abs=1e-8)
    (check,) = (check for check in planned.certificate.checks if check.quantity == "torque")
    assert check.satisfied
    assert check.method == "bounded"
    assert worst <= (check.ratio or 0.0) * (1.0 + 1e-9) <= 1.0 + 2e-9
    assert check.ratio == pytest.approx(worst, rel=2e-3)


def test_a_force_beyond_the_torque_limits_is_refused() -> None:
    with pytest.raises(LimitsUnsatisfiable, match="process force"):
        plan(drilling(Limits(), ProcessForce((0.0, 0.0, 20_000.0))))


@pytest.mark.large_only
def test_a_proof_covers_torque_with_a_process_force() -> None:
    for force in (None, DRILL):
        proof = write_proof(plan(drilling(Limits(), force)))
        assert {"torque", "velocity"} <= set(check_proof(proof))
        stated = [robot["process_force"][1:] for robot in proof["statement"]["robots"]]
        assert np.any(stated) == (force is not None)


def test_faults_of_process_forces() -> None:
    good = drilling(Limits())
    waypoints = list(good.waypoints)
    for index, changed, fault in [
        (0, replace(waypoints[0], process_force=DRILL), ("waypoints", 0, "process_force")),
        (4, replace(waypoints[4], process_force=DRILL, motion=FreeMotion()), ("waypoints", 4, "process_force")),
        (1, replace(waypoints[1], transition=ThroughTransition()), ("waypoints", 1, "transition")),
        (
            2,
            replace(waypoints[2], process_force=ProcessForce((np.inf, 0.0, 0.0))),
            ("waypoints", 2, "process_force"),
        ),
    ]:
        bad = [changed if k == index else waypoint for k, waypoint in enumerate(waypoints)]
        with pytest.raises(InvalidProblem) as refusal:
            plan(replace(good, waypoints=bad))
        assert fault in [tuple(each.field) for each in refusal.value.faults]


def test_a_force_may_go_on_through_waypoints() -> None:
    """The tool grinds along two passed segments: the force is equal on both, so the robot need not stop."""
    there = (0.3, -1.2, 1.4, 0.1, 0.5, 0.1)
    on = [JointWaypoint(q, process_force=DRILL) for q in (there, ABOVE)]
    made = plan(PlanningProblem(ARM, [HOME, replace(on[0], transition=ThroughTransition()), on[1]]))
    at = made.trajectory.arrivals[1]
    assert np.abs(made.trajectory.evaluate(at, [1])[0]).max() > 0.1
    rows = made.samples(0.01, ["torque"])
    assert rows.torque is not None
    expected = torques(ARM, DRILL, np.array([rows.position, rows.velocity, rows.acceleration]))
    assert rows.torque[1:-1] == pytest.approx(expected[1:-1], abs=1e-8)
