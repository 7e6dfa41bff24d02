"""Following errors where the workpiece moves, against Pinocchio's models in the world at drawn actual positions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.certificate import certify
from planner.constraints import TOOL, TORQUE_WITH_TOLERANCES
from planner.kernels.serial_chain import torque_magnitudes
from planner.kinematics.forward import JointStates
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.robots import ExternalAxis, Robot, load_robot
from planner.robots.payload import Payload, ProcessForce
from planner.scene import AttachedObject, CollisionChecker, Scene, SceneObject
from planner.shapes import Box
from planner.spatial import FloatArray, Pose, rotation_from_rpy
from tests.planner.robots.held_parts import HeldPart
from tests.planner.robots.two_branches import TwoBranches

ERROR = 2e-3
FORCE = ProcessForce((30.0, -20.0, 50.0), (1.0, 2.0, 3.0), "base")
LOADED = replace(load_robot("kuka_kr16_2"), rated_payload=None).with_payload(Payload(4.0, (0.05, -0.02, 0.1)))
SLIDE = ExternalAxis(
    "slide", "prismatic", (1, 2, 0), Pose([1.0, 0.2, 0.4], rotation_from_rpy(0.3, 0.2, 0.1)), -0.5, 0.5, 1.0, 2.0,
    torque=2000.0, mass=80.0, center_of_mass=(0.1, -0.2, 0.3), inertia=(2.0, 0.1, -0.2, 3.0, 0.15, 2.5),
)  # fmt: skip
TURN = ExternalAxis(
    "turn", "revolute", (0, 1, 1), Pose([0.2, 0.1, 0.3], rotation_from_rpy(0.3, 0.0, 0.5)), -3.0, 3.0, 1.0, 2.0,
    torque=1000.0, mass=40.0, center_of_mass=(0.1, 0.2, 0.1), inertia=(2.0, 0.0, 0.0, 2.0, 0.0, 3.0),
)  # fmt: skip
PART = Pose([0.1, 0.05, 0.12], rotation_from_rpy(0.2, 0.3, 0.0))
CELLS: dict[str, TwoBranches | HeldPart] = {
    "positioner": TwoBranches(LOADED, [SLIDE, TURN], PART),
    "fixed tool": HeldPart(LOADED, Pose.from_rpy([1.2, 0.3, 0.9], [0.0, -1.5, 0.2]), PART),
}


def with_errors(robot: Robot) -> Robot:
    """Return a robot with following errors, one of them none."""
    errors = ERROR * np.random.default_rng(3).uniform(0.3, 1.0, robot.dof)
    errors[-1] = 0.0
    return robot.derived(limits={j.name: {"following_error": e} for j, e in zip(robot.joints, errors, strict=True)})


def offsets(robot: Robot, count: int) -> FloatArray:
    """Draw distances (count, joints) of actual positions from planned ones: corners of the box, and inside."""
    inside = np.random.default_rng(count).uniform(-1.0, 1.0, (count, robot.dof))
    inside[::2] = np.sign(inside[::2])
    inside *= [joint.following_error for joint in robot.joints]
    return inside


def relative(cell: TwoBranches | HeldPart, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the velocity of the tool in the workpiece's frame and its angular velocity, by differences."""
    step, place = 1e-6, cell.tool_in_workpiece if isinstance(cell, TwoBranches) else cell.tool_in_part
    before, after = place(q - step * v), place(q + step * v)
    turned = (after.rotation - before.rotation) @ place(q).rotation.T / (2.0 * step)
    return (after.translation - before.translation) / (2.0 * step), turned[[2, 0, 1], [1, 2, 0]]


def states_of(robot: Robot, count: int) -> FloatArray:
    rng, middle = np.random.default_rng(9), robot.middle
    q = middle + rng.uniform(-0.4, 0.4, (count, robot.dof))
    return np.array([q, *rng.uniform(-1.0, 1.0, (2, count, robot.dof))])


@pytest.mark.parametrize("force", [pytest.param(None, marks=pytest.mark.large_only), FORCE])
@pytest.mark.parametrize("name", CELLS)
def test_the_values_bound_the_torques_at_all_actual_positions(name: str, force: ProcessForce | None) -> None:
    """The force acts on the tool relative to the workpiece: by virtual work, its power is that of its torques."""
    cell = CELLS[name]
    robot = replace(with_errors(cell.robot), process_force=force)
    states, most = states_of(robot, 5), np.zeros((5, robot.dof))
    units = np.eye(robot.dof)
    for away in offsets(robot, 40):
        for k, (q, v, a) in enumerate(states.transpose(1, 0, 2)):
            torques = cell.torques(q + away, v, a)
            if force is not None:
                rates = [relative(cell, q + away, unit) for unit in units]
                torques += [linear @ force.force + angular @ force.moment for linear, angular in rates]
            most[k] = np.maximum(most[k], np.abs(torques))
    found = np.abs(TORQUE_WITH_TOLERANCES.values(JointStates(robot, *states)))
    assert (found >= most - 1e-6).all()
    assert found == pytest.approx(most, abs=0.01 * most.max())


@pytest.mark.parametrize("name", CELLS)
def test_magnitudes_bound_the_torques_at_all_positions(name: str) -> None:
    """The magnitudes of the links and of the force bound Pinocchio's torques, by no more than 50 times."""
    cell, force = CELLS[name], np.array([40.0, 5.0])
    links, slides = cell.robot.chain.links, ~cell.robot.is_angle
    reach = np.linalg.norm(links[:, 9:12], axis=1) + np.where(slides, 0.5, 0.0)
    own = [
        [mass, mass * np.linalg.norm(at), np.linalg.norm(about.reshape(3, 3), 2) + mass * at @ at]
        for mass, at, about in zip(links[:, 12], links[:, 13:16], links[:, 16:25], strict=True)
    ]
    tool = cell.robot.model.frames[cell.robot.tool_frame_id].placement.translation
    last = [9.81, force[0], force[1] + force[0] * np.linalg.norm(tool), cell.robot.dof - 1, len(cell.robot.positioner)]
    rows = np.vstack([np.column_stack([reach, own, ~slides]), last])
    rng, most = np.random.default_rng(2), np.zeros(cell.robot.dof)
    v, a = rng.uniform(0.5, 1.0, (2, cell.robot.dof))
    units = np.eye(cell.robot.dof)
    for _ in range(200):
        q = np.where(slides, rng.uniform(-0.5, 0.5), rng.uniform(-np.pi, np.pi, cell.robot.dof))
        torques = np.abs(cell.torques(q, v * rng.choice([-1.0, 1.0], len(v)), a * rng.choice([-1.0, 1.0], len(v))))
        rates = [relative(cell, q, unit) for unit in units]
        torques += [force[0] * np.linalg.norm(linear) + force[1] * np.linalg.norm(turn) for linear, turn in rates]
        most = np.maximum(most, torques)
    (bounds,) = torque_magnitudes(rows, v[None], a[None])
    assert (bounds >= most).all()
    assert (bounds <= 50.0 * most).all()


@pytest.mark.parametrize("name", CELLS)
def test_the_certificate_bounds_torques_and_tool_at_all_actual_positions(name: str) -> None:
    cell = CELLS[name]
    robot = with_errors(cell.robot)
    ends = [JointWaypoint(tuple(position)) for position in states_of(robot, 2)[0].tolist()]
    trajectory = plan(PlanningProblem(robot, ends), "quintic").trajectory
    checks = {check.quantity: check for check in certify(robot, trajectory).checks}
    states = np.array(trajectory.evaluate(np.linspace(0.0, trajectory.duration, 60), [0, 1, 2])).transpose(1, 0, 2)
    torques = [
        np.abs(cell.torques(q + away, v, a)) / robot.limit("torque")
        for away in offsets(robot, 40)
        for q, v, a in states
    ]
    ratio = checks[TORQUE_WITH_TOLERANCES.name].ratio
    assert ratio is not None
    assert np.max(torques) <= ratio
    assert ratio == pytest.approx(np.max(torques), rel=0.02)
    speed = TOOL["tcp_linear_velocity"].values(JointStates(robot, *states.transpose(1, 0, 2)))[:, 0]
    fastest = np.max(
        [[np.linalg.norm(relative(cell, q + away, v)[0]) for q, v, _ in states] for away in offsets(robot, 10)], axis=0
    )
    assert (speed >= fastest - 1e-6).all()
    assert speed.max() == pytest.approx(fastest.max(), rel=0.05)


@pytest.mark.parametrize("name", CELLS)
def test_displacements_of_pairs_are_bounded_by_their_margins(name: str) -> None:
    """At random positions, the distances of all pairs change by no more than the margins grow."""
    given = CELLS[name].robot
    robot = with_errors(given)
    part = AttachedObject("part", [Box((0.3, 0.2, 0.1))], Pose([0.1, 0.0, 0.1]), "workpiece", ["link_6"])
    block = SceneObject("block", [Box((0.3, 0.3, 1.0))], Pose([1.6, -0.8, 0.3]))
    checkers = [CollisionChecker(each, Scene([block], [part]), self_collision=True) for each in (robot, given)]
    grown, alone = checkers
    positions = states_of(robot, 4)[0]
    pairs = np.concatenate([np.arange(alone.own_pairs), np.flatnonzero(np.isfinite(alone.margins)) + alone.own_pairs])
    by = grown.margins_of(pairs) - alone.margins_of(pairs)
    planned = alone.bodies.at(positions)
    shrunk = np.zeros((len(pairs), len(positions)))
    for away in offsets(robot, 6):
        actual = alone.bodies.at(positions + away)
        for k, pair in enumerate(pairs.tolist()):
            for row in range(len(positions)):
                before, after = (alone.separate(places, row, pair).distance for places in (planned, actual))
                shrunk[k, row] = max(shrunk[k, row], before - after)
    assert (shrunk <= by[:, None] + 1e-6).all()
    assert shrunk.max() > 0.1 * by.max()
