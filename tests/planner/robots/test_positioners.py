"""Positioners that carry the workpiece, checked against arm and positioner as two models of Pinocchio in the world."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from planner.dynamics import inverse_dynamics, path_dynamics
from planner.dynamics.symbolic import symbolic_motion
from planner.dynamics.torque_tolerances import torque_tolerances
from planner.errors import InvalidRobotModel
from planner.kinematics import jacobian, tool_pose
from planner.kinematics.configurations import configurations
from planner.robots import ExternalAxis, load_robot
from planner.robots.payload import Payload, ProcessForce
from planner.scene import AttachedObject, CollisionChecker, Scene, SceneObject
from planner.shapes import Box, Sphere
from planner.spatial import Pose, rotation_from_rpy
from planner.speed_zones import moving_bodies, point_speeds
from tests.planner.robots.two_branches import TwoBranches, se3

KUKA = load_robot("kuka_kr16_2")
KINDS = (["revolute"], ["prismatic", "revolute"], ["revolute", "revolute", "prismatic"])
RNG = np.random.default_rng(3)


def random_pose() -> Pose:
    return Pose(RNG.uniform(-1.0, 1.0, 3), rotation_from_rpy(*RNG.uniform(-3.0, 3.0, 3)))


def random_axis(number: int, kind: str) -> ExternalAxis:
    body = {"mass": 40.0 + number, "center_of_mass": (0.1, -0.2, 0.3), "inertia": (2.0, 0.1, -0.2, 3.0, 0.15, 2.5)}
    return ExternalAxis(f"e{number}", kind, RNG.normal(size=3), random_pose(), -3.0, 3.0, **body)  # type: ignore[arg-type]


MOUNTED = KUKA.derived(mounting=random_pose(), tool=random_pose()).with_payload(Payload(3.0, (0.1, 0.0, 0.2)))
CELLS = [TwoBranches(MOUNTED, [random_axis(k, kind) for k, kind in enumerate(kinds)], random_pose()) for kinds in KINDS]
RAIL = ExternalAxis("rail", "prismatic", (0, 1, 0), lower=-3.0, upper=3.0, mass=50.0)
CELLS.append(TwoBranches(KUKA.derived(external_axes=[RAIL]), [random_axis(0, "revolute")], random_pose()))


def states(cell: TwoBranches, count: int = 3) -> np.ndarray:
    return np.random.default_rng(count).uniform(-2.0, 2.0, (count, 3, cell.robot.dof))


@pytest.mark.parametrize("cell", CELLS)
def test_poses_are_those_of_the_tool_in_the_frame_of_the_workpiece(cell: TwoBranches) -> None:
    assert cell.robot.positioner == tuple(axis.name for axis in reversed(cell.axes))
    assert cell.robot.external_axes[: len(cell.axes)] == cell.robot.positioner
    for q, *_ in states(cell):
        np.testing.assert_allclose(
            se3(tool_pose(cell.robot, q)).homogeneous, cell.tool_in_workpiece(q).homogeneous, atol=1e-12
        )


@pytest.mark.parametrize("cell", CELLS)
def test_torques_are_those_of_arm_and_positioner_in_the_world(cell: TwoBranches) -> None:
    """The compiled algorithm, its terms along a path and the symbolic expression agree with two runs of Pinocchio's."""
    robot = cell.robot
    symbols = [ca.SX.sym(name, robot.dof) for name in "qva"]
    symbolic = ca.Function("torques", symbols, [symbolic_motion(robot, *symbols).torques])
    for q, v, a in states(cell):
        expected = cell.torques(q, v, a)
        np.testing.assert_allclose(inverse_dynamics(robot, q, v, a), expected, atol=1e-8)
        np.testing.assert_allclose(np.array(symbolic(q, v, a)).ravel(), expected, atol=1e-8)
        terms = path_dynamics(robot, q[None], v[None], a[None])
        np.testing.assert_allclose((terms.centripetal + terms.gravity)[0], expected, atol=1e-8)
        of_inertia = cell.torques(q, 0.0 * v, v) - cell.torques(q, 0.0 * v, 0.0 * v)
        np.testing.assert_allclose(terms.inertia[0], of_inertia, atol=1e-8)


@pytest.mark.parametrize("frame", ["base", "tool"])
@pytest.mark.parametrize("cell", CELLS[1:3])
def test_a_process_force_acts_on_the_workpiece_and_loads_the_positioner(cell: TwoBranches, frame: str) -> None:
    """By virtual work, the torques that it adds are the Jacobian's transpose times the force."""
    robot = replace(cell.robot, process_force=ProcessForce((10.0, -20.0, 5.0), (1.0, 2.0, 3.0), frame))  # type: ignore[arg-type]
    symbols = [ca.SX.sym(name, robot.dof) for name in "qva"]
    symbolic = ca.Function("torques", symbols, [symbolic_motion(robot, *symbols).torques])
    for q, v, a in states(cell):
        turn = np.eye(3) if frame == "base" else np.asarray(tool_pose(robot, q).rotation)
        wrench = np.concatenate([turn @ [10.0, -20.0, 5.0], turn @ [1.0, 2.0, 3.0]])
        expected = cell.torques(q, v, a) + jacobian(robot, q).T @ wrench
        np.testing.assert_allclose(inverse_dynamics(robot, q, v, a), expected, atol=1e-8)
        np.testing.assert_allclose(np.array(symbolic(q, v, a)).ravel(), expected, atol=1e-8)


@pytest.mark.parametrize("cell", CELLS)
def test_the_scene_stands_in_the_world_and_objects_on_the_workpiece_move(cell: TwoBranches) -> None:
    """Distances of two spheres, on workpiece and tool, from a third one in the world and from each other."""
    robot, spheres = cell.robot, [Sphere(0.01)]
    at, on = np.array([0.1, 0.2, 0.3]), np.array([0.2, -0.1, 0.4])
    scene = Scene(
        [SceneObject("post", spheres, Pose(at))],
        [AttachedObject("part", spheres, Pose(on), "workpiece"), AttachedObject("wire", spheres)],
        margin=0.02,
    )
    checker = CollisionChecker(robot, scene, self_collision=False)
    pairs = {frozenset(checker.names(k)): k for k in range(checker.own_pairs + len(checker.bodies.pieces))}
    mounting = se3(robot.mounting)
    for q, *_ in states(cell):
        part = (mounting * cell.links(q)[-1] * se3(cell.workpiece)).act(on)
        wire = (mounting * cell.tool(q)).translation
        placements = checker.bodies.at(q[None])
        for names, apart in (("part", part - at), ("wire", wire - at), ("wire part", part - wire)):
            pair = pairs[frozenset(names.split()) | (frozenset() if " " in names else {"post"})]
            assert checker.separate(placements, 0, pair).distance == pytest.approx(np.linalg.norm(apart) - 0.02)
            assert checker.margins_of(np.array([pair]))[0] == 0.02
        near = checker.near_items(q[None], np.zeros((1, robot.dof)), np.full_like(checker.margins, 9.0), 9.0)
        bounds = dict(zip(near.pairs.tolist(), near.bounds.tolist(), strict=True))  # by the compiled frames
        assert bounds[pairs[frozenset({"part", "wire"})]] == pytest.approx(np.linalg.norm(part - wire) - 0.02, abs=1e-6)
    pieces = checker.bodies.pieces
    across = [{pieces[k].name for k in pair} for pair in zip(checker.first, checker.second, strict=True)]
    assert all("part" in names for names in across)  # the part is checked whatever `self_collision` is
    assert {"link_6", "wire"} <= set().union(*across)


def test_speed_zones_know_the_speeds_of_points_in_the_world() -> None:
    cell = CELLS[2]
    scene = Scene(attached=[AttachedObject("part", [Box([0.2, 0.1, 0.3])], random_pose(), "workpiece")])
    bodies = moving_bodies(cell.robot, CollisionChecker(cell.robot, scene))
    for q, v, _ in states(cell):
        h, rest = 1e-6, np.where(np.arange(cell.robot.dof) < 3, v, 0.0)  # the arm stands still in the world
        found = point_speeds(bodies, q[None], rest[None])[0]
        corner = se3(scene.attached[0].pose).act(np.array([0.1, 0.05, 0.15]))
        there = [(cell.links(q + k * h * rest)[-1] * se3(cell.workpiece)).act(corner) for k in (-1.0, 1.0)]
        least = float(np.linalg.norm(there[1] - there[0])) / (2.0 * h)
        assert 0.5 * found <= least <= found * (1.0 + 1e-6)


def test_fixed_axes_of_a_positioner_leave_the_arm_where_it_stands() -> None:
    cell, q = CELLS[2], states(CELLS[2])[0, 0]
    names = cell.robot.positioner
    for held in (names[:1], names[1:2], names[2:], names[::2], names):
        fixed = cell.robot.derived(locked={name: float(q[cell.robot.joint_names.index(name)]) for name in held})
        left = [k for k, name in enumerate(cell.robot.joint_names) if name not in held]
        assert fixed.positioner == tuple(name for name in names if name not in held)
        np.testing.assert_allclose(
            se3(tool_pose(fixed, q[left])).homogeneous, cell.tool_in_workpiece(q).homogeneous, atol=1e-12
        )
        for _, v, a in states(cell):
            rates = [np.where(np.isin(cell.robot.joint_names, held), 0.0, rate) for rate in (v, a)]
            torques = inverse_dynamics(fixed, q[left], rates[0][left], rates[1][left])
            np.testing.assert_allclose(torques, cell.torques(q, *rates)[left], atol=1e-8)
        checker = CollisionChecker(fixed, Scene(attached=[AttachedObject("wire", [Sphere(0.01)])]))
        _, origins = checker.bodies.frames(q[None, left])
        base = pin.SE3.Identity() if fixed.mounting is None else se3(fixed.mounting)
        wrist = se3(cell.robot.mounting) * cell.tool(q) * se3(Pose(*_inverse(fixed)))
        np.testing.assert_allclose(base.act(origins[0, -1]), wrist.translation, atol=1e-9)
        assert configurations(fixed, q[None, left]) == configurations(cell.arm, q[None, 3:])


def _inverse(robot: object) -> tuple[np.ndarray, np.ndarray]:
    """Return the placement of the last joint's frame in the tool's."""
    placement = robot.model.frames[robot.tool_frame_id].placement.inverse()  # type: ignore[attr-defined]
    return placement.translation, placement.rotation


def test_a_positioner_on_a_mounted_arm_feels_the_world_s_gravity() -> None:
    """A mounting given later is that of the frame in which arm and positioner stand."""
    cell, turned = CELLS[1], random_pose()
    again = TwoBranches(cell.arm.derived(mounting=turned), cell.axes, cell.workpiece)
    mounted = cell.robot.derived(mounting=turned)
    for q, v, a in states(cell):
        np.testing.assert_allclose(inverse_dynamics(mounted, q, v, a), again.torques(q, v, a), atol=1e-8)
    moving = sum(axis.mass or 0.0 for axis in cell.axes) + cell.arm.mass
    assert cell.robot.mass == pytest.approx(moving)


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"workpiece": Pose(np.zeros(3))}, "no_positioner"),
        ({"positioner": [ExternalAxis("workpiece", "continuous", (0, 0, 1))]}, "duplicate_name"),
        ({"positioner": [ExternalAxis("joint_a1", "continuous", (0, 0, 1))]}, "duplicate_name"),
        ({"positioner": [ExternalAxis("turn", "revolute", (0, 0, 1))]}, "missing_position_limit"),
    ],
)
def test_a_positioner_that_cannot_be_is_refused(changes: dict[str, object], code: str) -> None:
    with pytest.raises(InvalidRobotModel) as refused:
        KUKA.derived(**changes)  # type: ignore[arg-type]
    assert {finding.code for finding in refused.value.findings if finding.severity == "error"} == {code}


def test_a_second_positioner_and_axes_under_the_workpiece_are_refused() -> None:
    turn = ExternalAxis("turn", "continuous", (0, 0, 1))
    beside = KUKA.derived(positioner=[turn])
    for changes, code in (
        ({"positioner": [replace(turn, name="tilt")]}, "second_positioner"),
        ({"external_axes": [replace(turn, name="rail")]}, "axes_with_positioner"),
    ):
        with pytest.raises(InvalidRobotModel) as refused:
            beside.derived(**changes)  # type: ignore[arg-type]
        assert {finding.code for finding in refused.value.findings} >= {code}
    assert all(a != b for a, b in pairwise(beside.joint_names))


def test_tolerances_of_a_payload_reach_the_torques_of_the_arm_alone() -> None:
    cell, loose = (
        CELLS[1],
        Payload(3.0, (0.1, 0.0, 0.2), mass_tolerance=0.5, center_of_mass_tolerance=(0.02, 0.0, 0.01)),
    )
    with_both, alone = (torque_tolerances(robot.with_payload(loose)) for robot in (cell.robot, cell.arm))
    assert with_both is not None
    assert alone is not None
    q, v, a = states(cell).swapaxes(0, 1)
    generators = with_both.torques(q, v, a)
    np.testing.assert_allclose(generators[..., :2], 0.0, atol=1e-12)
    np.testing.assert_allclose(generators[..., 2:], alone.torques(q[:, 2:], v[:, 2:], a[:, 2:]), atol=1e-9)
