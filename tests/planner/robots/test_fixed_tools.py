"""Arms that hold the workpiece under a fixed tool, checked against Pinocchio's model of the arm alone in the world."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from planner.dynamics import inverse_dynamics, path_dynamics
from planner.dynamics.symbolic import symbolic_motion
from planner.dynamics.torque_tolerances import torque_tolerances
from planner.errors import InvalidRobotModel
from planner.kinematics import all_solutions, jacobian, manipulability, tool_pose, tool_velocities
from planner.kinematics.configurations import configurations, named_parts
from planner.robots import ExternalAxis, load_robot
from planner.robots.payload import Payload, ProcessForce
from planner.scene import AttachedObject, CollisionChecker, Scene, SceneObject
from planner.shapes import Sphere
from planner.spatial import Pose, rotation_from_rpy
from tests.planner.robots.held_parts import HeldPart
from tests.planner.robots.two_branches import se3

KUKA = load_robot("kuka_kr16_2")
RNG = np.random.default_rng(5)


def random_pose() -> Pose:
    return Pose(RNG.uniform(-1.0, 1.0, 3), rotation_from_rpy(*RNG.uniform(-3.0, 3.0, 3)))


PART = Payload(3.0, (0.1, 0.0, 0.2))
CELLS = [
    HeldPart(load_robot(name).derived(mounting=random_pose()).with_payload(PART), random_pose(), random_pose())
    for name in ("kuka_kr16_2", "ur5e", "fr3", "date_sorting_arm")
]


def states(cell: HeldPart, count: int = 3) -> np.ndarray:
    return np.random.default_rng(count).uniform(-2.0, 2.0, (count, 3, cell.robot.dof))


@pytest.mark.parametrize("cell", CELLS)
def test_poses_and_speeds_are_those_of_the_tool_relative_to_the_part(cell: HeldPart) -> None:
    assert cell.robot.joint_names == cell.arm.joint_names[::-1] == cell.robot.positioner
    for q, v, _ in states(cell):
        np.testing.assert_allclose(
            se3(tool_pose(cell.robot, q)).homogeneous, cell.tool_in_part(q).homogeneous, atol=1e-12
        )
        np.testing.assert_allclose(
            [*tool_velocities(cell.robot, q[None], v[None])], [[r] for r in cell.rates(q, v)], atol=1e-10
        )


@pytest.mark.parametrize("cell", CELLS)
def test_torques_are_those_of_the_arm_with_the_part(cell: HeldPart) -> None:
    """The compiled algorithm, its terms along a path and the symbolic expression agree with Pinocchio on the arm."""
    robot = cell.robot
    symbols = [ca.SX.sym(name, robot.dof) for name in "qva"]
    symbolic = ca.Function("torques", symbols, [symbolic_motion(robot, *symbols).torques])
    held = cell.arm.derived(fixed_tool=cell.fixed_tool).with_payload(PART)  # in the frame of the flange
    heavier = HeldPart(cell.arm.with_payload(PART), cell.fixed_tool, cell.workpiece)
    assert robot.mass == pytest.approx(cell.arm.mass)
    for q, v, a in states(cell):
        expected = cell.torques(q, v, a)
        np.testing.assert_allclose(inverse_dynamics(robot, q, v, a), expected, atol=1e-8)
        np.testing.assert_allclose(np.array(symbolic(q, v, a)).ravel(), expected, atol=1e-8)
        terms = path_dynamics(robot, q[None], v[None], a[None])
        np.testing.assert_allclose((terms.centripetal + terms.gravity)[0], expected, atol=1e-8)
        np.testing.assert_allclose(inverse_dynamics(held, q, v, a), heavier.torques(q, v, a), atol=1e-8)


@pytest.mark.parametrize("frame", ["base", "tool"])
@pytest.mark.parametrize("cell", CELLS[:2])
def test_the_force_of_the_tool_on_the_part_loads_the_arm(cell: HeldPart, frame: str) -> None:
    """By virtual work: the power of the force is that of the torques that it adds."""
    force, moment = np.array([10.0, -20.0, 5.0]), np.array([1.0, 2.0, 3.0])
    robot = replace(cell.robot, process_force=ProcessForce(tuple(force), tuple(moment), frame))  # type: ignore[arg-type]
    symbols = [ca.SX.sym(name, robot.dof) for name in "qva"]
    symbolic = ca.Function("torques", symbols, [symbolic_motion(robot, *symbols).torques])
    for q, v, a in states(cell):
        turn = np.eye(3) if frame == "base" else cell.tool_in_part(q).rotation
        added = inverse_dynamics(robot, q, v, a) - cell.torques(q, v, a)
        linear, angular = cell.rates(q, v)
        assert added @ v == pytest.approx(turn @ force @ linear + turn @ moment @ angular)
        np.testing.assert_allclose(np.array(symbolic(q, v, a)).ravel(), inverse_dynamics(robot, q, v, a), atol=1e-8)


@pytest.mark.parametrize("cell", CELLS[:2])
def test_tolerances_of_the_part_cover_what_it_may_weigh(cell: HeldPart) -> None:
    """The generators reach the torques of the heaviest part, whose inertia about its centre is as given."""
    uncertain = Payload(2.0, (0.1, 0.05, 0.2), mass_tolerance=0.5)
    tolerances = torque_tolerances(cell.robot.with_payload(uncertain))
    assert tolerances is not None
    sides = [
        HeldPart(cell.arm.with_payload(replace(uncertain, mass=m, mass_tolerance=0.0)), cell.fixed_tool, cell.workpiece)
        for m in (2.5, 2.0)
    ]
    for q, v, a in states(cell):
        heavy, given = (side.torques(q, v, a) for side in sides)
        np.testing.assert_allclose(np.abs(tolerances.torques(q, v, a)).sum(axis=0), np.abs(heavy - given), atol=1e-8)


@pytest.mark.parametrize("cell", CELLS[:2])
def test_all_solutions_and_names_are_those_of_the_arm(cell: HeldPart) -> None:
    """The arm has to bring the part to where the tool has the requested pose: as many solutions, in closed form."""
    assert named_parts(cell.robot) == named_parts(cell.arm) == ("shoulder", "elbow", "wrist")
    for q, *_ in states(cell, 5):
        q = np.clip(q, cell.robot.limit("lower"), cell.robot.limit("upper"))
        found = np.array(all_solutions(cell.robot, tool_pose(cell.robot, q)))
        of_arm = np.array(all_solutions(cell.arm, tool_pose(cell.arm, q[::-1])))
        distances = np.abs(found[:, None] - of_arm[None, :, ::-1]).max(axis=2)
        assert len(found) == len(of_arm)
        assert distances.min(axis=0).max() < 1e-6
        assert configurations(cell.robot, found) == configurations(cell.arm, found[:, ::-1])
        assert manipulability(cell.robot, q) == pytest.approx(manipulability(cell.arm, q[::-1]))


@pytest.mark.parametrize("cell", CELLS[:1])
def test_the_scene_stands_in_the_world_and_the_part_moves(cell: HeldPart) -> None:
    """Distances of a sphere on the part from one in the world; the pairs of links are the same."""
    spheres, at, on = [Sphere(0.01)], np.array([0.1, 0.2, 0.3]), np.array([0.2, -0.1, 0.4])
    attached = AttachedObject("part", spheres, Pose(on), "workpiece", touch_links=["link_6"])
    checker = CollisionChecker(cell.robot, Scene([SceneObject("post", spheres, Pose(at))], [attached]))
    pair = next(
        k for k in range(checker.own_pairs + len(checker.bodies.pieces)) if {*checker.names(k)} == {"part", "post"}
    )
    for q, *_ in states(cell):
        part = (se3(cell.robot.mounting) * cell.part(q)).act(on)
        placements = checker.bodies.at(q[None])
        assert checker.separate(placements, 0, pair).distance == pytest.approx(np.linalg.norm(part - at) - 0.02)
    own = {frozenset((pair.link_1, pair.link_2)): pair.reason for pair in cell.robot.collision_pairs}
    assert own == {frozenset((pair.link_1, pair.link_2)): pair.reason for pair in cell.arm.collision_pairs}


@pytest.mark.parametrize("cell", CELLS[:3])
def test_links_are_where_the_arm_has_them(cell: HeldPart) -> None:
    """Shapes have the same places in the world as on the arm alone."""
    both = [CollisionChecker(robot, Scene()).bodies for robot in (cell.robot, cell.arm)]
    for q, *_ in states(cell):
        found = []
        for bodies, positions in zip(both, (q, q[::-1]), strict=True):
            rotations, origins = bodies.frames(positions[None])
            found.append(
                {
                    (piece.name, id(piece.shape)): rotations[0, piece.joint] @ piece.translation
                    + origins[0, piece.joint]
                    for piece in bodies.pieces
                }
            )
        assert found[0].keys() == found[1].keys()
        for piece, place in found[0].items():
            np.testing.assert_allclose(place, found[1][piece], atol=1e-9)


def test_joints_that_are_fixed_leave_the_part_where_it_is() -> None:
    cell, q = CELLS[0], states(CELLS[0])[0, 0]
    for name in ("joint_a6", "joint_a3", "joint_a1"):
        fixed = cell.robot.derived(locked={name: float(np.clip(q[cell.robot.joint_names.index(name)], -1.0, 1.0))})
        whole = np.where(np.array(cell.robot.joint_names) == name, np.clip(q, -1.0, 1.0), q)
        left = [k for k, other in enumerate(cell.robot.joint_names) if other != name]
        np.testing.assert_allclose(
            se3(tool_pose(fixed, whole[left])).homogeneous, cell.tool_in_part(whole).homogeneous, atol=1e-12
        )
        torques = inverse_dynamics(fixed, whole[left], np.zeros(5), np.zeros(5))
        np.testing.assert_allclose(torques, cell.torques(whole, np.zeros(6), np.zeros(6))[left], atol=1e-8)


TOOL = Pose([1.0, 0.0, 0.5])
TURN = ExternalAxis("turn", "continuous", (0, 0, 1))


@pytest.mark.parametrize(
    ("robot", "changes", "code"),
    [
        (KUKA, {"fixed_tool": TOOL, "positioner": [TURN]}, "axes_with_fixed_tool"),
        (KUKA, {"fixed_tool": TOOL, "external_axes": [TURN]}, "axes_with_fixed_tool"),
        (KUKA, {"fixed_tool": TOOL, "tool": TOOL}, "tool_with_fixed_tool"),
        (KUKA, {"fixed_tool": Pose([1.0, 0.0, 0.0], 2.0 * np.eye(3))}, "invalid_pose"),
        (KUKA, {"workpiece": TOOL}, "no_positioner"),
        (KUKA.derived(positioner=[TURN]), {"fixed_tool": TOOL}, "second_positioner"),
        (KUKA.derived(fixed_tool=TOOL), {"fixed_tool": TOOL}, "second_positioner"),
        (KUKA.derived(fixed_tool=TOOL), {"positioner": [TURN]}, "second_positioner"),
        (KUKA.derived(fixed_tool=TOOL), {"external_axes": [TURN]}, "axes_with_positioner"),
    ],
)  # fmt: skip
def test_a_fixed_tool_that_cannot_be_is_refused(robot: object, changes: dict[str, object], code: str) -> None:
    with pytest.raises(InvalidRobotModel) as refused:
        robot.derived(**changes)  # type: ignore[attr-defined]
    assert {finding.code for finding in refused.value.findings if finding.severity == "error"} == {code}


def test_another_fixed_tool_takes_the_place_of_the_first() -> None:
    cell = CELLS[0]
    other = HeldPart(cell.arm, random_pose(), cell.workpiece)
    for changed in (cell.robot.with_tool(other.fixed_tool), cell.robot.derived(tool=other.fixed_tool)):
        for q, *_ in states(cell):
            np.testing.assert_allclose(
                se3(tool_pose(changed, q)).homogeneous, other.tool_in_part(q).homogeneous, atol=1e-12
            )
            np.testing.assert_allclose(
                np.linalg.norm(jacobian(changed, q)[:3, 0]), np.linalg.norm(other.rates(q, np.eye(6)[0])[0])
            )
