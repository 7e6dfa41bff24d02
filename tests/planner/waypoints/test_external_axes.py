"""Arms on external axes: their plans are checked against the arm alone, moved to the position of its base."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from planner.backends import BACKENDS
from planner.errors import InvalidProblem, UnreachableWaypoint
from planner.kinematics import all_solutions, configurations, forward_kinematics, inverse_kinematics, named_parts
from planner.kinematics.options import InverseKinematicsOptions
from planner.planning import plan
from planner.problems.motion_around import FreeMotion
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.robots import ExternalAxis, Robot, load_robot
from planner.scene import Scene, SceneObject
from planner.shapes import Sphere
from planner.spatial import Pose, rotation_from_rpy, rotation_z
from planner.waypoints.reachability import reachability
from tests.planner.problems_of_tests import random_position
from tests.sizes import NAME

if TYPE_CHECKING:
    from planner.kinematics import FloatArray

ARMS = {name: load_robot(name) for name in ("ur5e", "kuka_kr16_2", "fr3")}
RAIL = ExternalAxis("rail", "prismatic", (1, 0, 0), lower=0.0, upper=3.0, velocity=1.0, mass=60.0)
ON_RAIL = {name: arm.derived(external_axes=[RAIL]) for name, arm in ARMS.items()}
STARTS = {
    "ur5e": [0.5, 0.0, -1.2, 1.6, -1.9, -1.57, 0.3],
    "kuka_kr16_2": [0.5, 0.0, -1.3, 1.6, 0.0, 1.2, 0.3],
    "fr3": [0.5, 0.0, 0.0, 0.0, -1.6, 0.0, 1.9, 0.3],
}
TURNTABLE = ExternalAxis("table", "continuous", (0, 0, 1), velocity=1.0)
ON_TABLE = ARMS["kuka_kr16_2"].derived(external_axes=[TURNTABLE], arm_origin=Pose(np.array([0.4, 0.0, 0.2])))


def moved(pose: Pose, x: float, y: float = 0.0) -> Pose:
    return Pose(pose.position + np.array([x, y, 0.0]), pose.rotation)


def start_pose(name: str) -> Pose:
    return forward_kinematics(ON_RAIL[name], [STARTS[name]])[0]


def positions(robot: Robot, *waypoints: JointWaypoint | PoseWaypoint, prefer: str = "continuous") -> FloatArray:
    """Return the positions of all waypoints of the plan."""
    options = InverseKinematicsOptions(prefer=prefer)  # type: ignore[arg-type]
    return plan(PlanningProblem(robot, waypoints, inverse_kinematics=options)).path.positions


@pytest.mark.parametrize("name", ["ur5e", "kuka_kr16_2"])
def test_configurations_are_those_of_the_arm(name: str) -> None:
    arm, robot, rng = ARMS[name], ON_RAIL[name], np.random.default_rng(0)
    q = np.array([random_position(robot, rng) for _ in range(50)])
    assert named_parts(robot) == ("shoulder", "elbow", "wrist")
    assert configurations(robot, q) == configurations(arm, q[:, 1:])


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("kind", BACKENDS)
@pytest.mark.long_table
def test_a_line_along_the_rail_is_followed_by_arm_and_rail(name: str, kind: str) -> None:
    """The arm alone cannot; at dense times it is at its own inverse kinematics, relative to the rail."""
    arm, robot, start = ARMS[name], ON_RAIL[name], start_pose(name)
    goal = moved(start, 2.0)
    with pytest.raises(UnreachableWaypoint):
        positions(arm, JointWaypoint(STARTS[name][1:]), PoseWaypoint(moved(goal, -0.5), motion=LinearMotion()))
    requested = [JointWaypoint(STARTS[name]), PoseWaypoint(goal, motion=LinearMotion())]
    found = plan(PlanningProblem(robot, requested), BACKENDS[kind]())
    assert found.certificate.satisfied
    times = np.linspace(0.0, found.trajectory.duration, 60)
    q, v, *_ = found.trajectory.evaluate(times, [0, 1])
    assert (np.abs(v) <= robot.limit("velocity") * (1.0 + 1e-6)).all()
    assert (np.diff(q[:, 0]) >= -1e-9).all()
    for k, row in enumerate(q):
        reached = forward_kinematics(arm, [row[1:]])[0]
        off = reached.position + np.array([row[0], 0.0, 0.0]) - start.position
        assert np.linalg.norm(off[1:]) < 1.1e-4
        assert np.abs(reached.rotation - start.rotation).max() < 1.1e-3
        if k % 6 == 0:
            own = inverse_kinematics(arm, reached, reference=row[1:])
            np.testing.assert_allclose(own.position, row[1:], atol=1e-5)


@pytest.mark.sized
@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("motion", [None, LinearMotion()])
def test_a_pinned_axis_is_where_it_is_pinned_and_the_arm_does_the_rest(name: str, motion: LinearMotion | None) -> None:
    arm, robot, start = ARMS[name], ON_RAIL[name], start_pose(name)
    rng, planned = np.random.default_rng(1), 0
    kept = {} if motion is None else {"motion": motion}
    for _ in range(4 if NAME == "quick" else 12):
        pin = float(rng.uniform(1.0, 3.0))
        goal = moved(start, pin - 0.5 + float(rng.uniform(-0.15, 0.05)), float(rng.uniform(-0.1, 0.1)))
        solutions = all_solutions(arm, moved(goal, -pin))
        waypoint = PoseWaypoint(goal, external={"rail": pin}, **kept)  # type: ignore[arg-type]
        requested = [JointWaypoint(STARTS[name]), waypoint]
        if not solutions:
            with pytest.raises(UnreachableWaypoint):
                positions(robot, *requested)
            continue
        solved = plan(PlanningProblem(robot, requested)).path.waypoints[-1]
        assert solved.position[0] == pytest.approx(pin, abs=1e-9)
        reached = forward_kinematics(arm, [solved.position[1:]])[0]
        np.testing.assert_allclose(reached.position, goal.position - [pin, 0.0, 0.0], atol=2e-6)
        if robot.dof == 7:
            away = [np.abs((q - solved.position[1:] + np.pi) % (2.0 * np.pi) - np.pi).max() for q in solutions]
            assert min(away) < 1e-5
            assert solved.solutions == len(solutions)
        planned += 1
    assert planned >= 2


def test_a_pin_holds_where_the_pose_is_free_the_motion_goes_around_and_what_follows_is_a_line() -> None:
    robot, start = ON_RAIL["ur5e"], start_pose("ur5e")
    pin = {"rail": 1.25}
    home = JointWaypoint(STARTS["ur5e"])
    free = PoseWaypoint(moved(start, 0.8), external=pin, free="rotation_z")
    around = PoseWaypoint(moved(start, 0.8), external=pin, motion=FreeMotion())
    line = PoseWaypoint(moved(start, 2.0, 0.1), motion=LinearMotion())
    found = positions(robot, home, free, around, line)
    np.testing.assert_allclose(found[1:3, 0], 1.25, atol=1e-9)
    (alone,) = reachability(robot, [PoseWaypoint(moved(start, 0.8), external=pin)], InverseKinematicsOptions())
    assert alone.best is not None
    assert alone.best[0] == 1.25
    assert alone.solutions == len(all_solutions(ARMS["ur5e"], moved(start, 0.8 - 1.25)))


@pytest.mark.parametrize("rail", [0.3, 0.7])
def test_a_pin_holds_where_a_line_ends_in_a_region_that_was_searched_in_a_scene(rail: float) -> None:
    """A joint position with clearance kept its pose, and the line ended with the rail elsewhere."""
    robot, start = ON_RAIL["ur5e"], start_pose("ur5e")
    goal = PoseWaypoint(moved(start, 0.1), free="rotation_z", external={"rail": rail}, motion=LinearMotion())
    far = Scene([SceneObject("far", [Sphere(0.1)], Pose([9.0, 9.0, 9.0]))])
    found = plan(PlanningProblem(robot, [JointWaypoint(STARTS["ur5e"]), goal], scene=far))
    assert abs(found.trajectory.evaluate(found.trajectory.duration, [0])[0][0] - rail) <= 1e-6


def test_a_pin_of_a_turntable_means_no_other_whole_turn() -> None:
    pose = forward_kinematics(ON_TABLE, [[0.0, 0.2, -1.3, 1.6, 0.0, 1.2, 0.3]])[0]
    start = JointWaypoint([6.0, 0.2, -1.3, 1.6, 0.0, 1.2, 0.3])
    found = positions(ON_TABLE, start, PoseWaypoint(pose, external={"table": 0.1}))
    assert found[1, 0] == pytest.approx(0.1, abs=1e-9)
    turn = rotation_z(-0.1)
    own = Pose(turn @ pose.position - [0.4, 0.0, 0.2], turn @ pose.rotation)
    reached = forward_kinematics(ARMS["kuka_kr16_2"], [found[1, 1:]])[0]
    np.testing.assert_allclose(reached.position, own.position, atol=2e-6)


def test_pins_that_contradict_the_robot_are_faults() -> None:
    goal = PoseWaypoint(start_pose("ur5e"), external={"rail": 3.5, "lift": 0.0})
    with pytest.raises(InvalidProblem) as refused:
        positions(ON_RAIL["ur5e"], goal)
    assert {fault.field for fault in refused.value.faults} == {
        ("waypoints", 0, "external", "rail"),
        ("waypoints", 0, "external", "lift"),
    }
    with pytest.raises(InvalidProblem):
        positions(ARMS["ur5e"], goal)


def test_without_its_pin_a_pose_out_of_reach_is_reached() -> None:
    robot, start = ON_RAIL["kuka_kr16_2"], JointWaypoint(STARTS["kuka_kr16_2"])
    goal = PoseWaypoint(moved(start_pose("kuka_kr16_2"), 2.0), external={"rail": 0.5})
    with pytest.raises(UnreachableWaypoint) as refused:
        positions(robot, start, goal)
    (remedy,) = [remedy for remedy in refused.value.remedies if remedy.field == ("waypoints", 1, "external")]
    positions(robot, start, replace(goal, external=remedy.value))


@pytest.mark.sized
@pytest.mark.parametrize("name", ARMS)
def test_the_arm_reaches_alone_where_it_can_and_else_the_rail_moves_little(name: str) -> None:
    """The truth is the arm at many positions of the rail: the nearest position with a solution."""
    arm, robot, rng = ARMS[name], ON_RAIL[name], np.random.default_rng(2)
    start, step, stays = start_pose(name), 0.05 if name == "fr3" else 0.01, 0
    rails = np.arange(0.0, 3.0 + step, step)
    for k in range(4 if NAME == "quick" else 20):
        far = 1.6 if k % 2 else 0.1
        goal = moved(start, float(rng.uniform(-0.1, far)), float(rng.uniform(-0.2, 0.2) * far))
        goal = Pose(goal.position, rotation_from_rpy(*rng.uniform(-0.2, 0.2, 3) * far) @ goal.rotation)
        found = positions(robot, JointWaypoint(STARTS[name]), PoseWaypoint(goal), prefer="arm")[-1]
        nearest = sorted(rails, key=lambda x: abs(x - 0.5))
        least = next(abs(x - 0.5) for x in nearest if all_solutions(arm, moved(goal, -float(x))))
        assert abs(found[0] - 0.5) <= least + (1e-9 if least < step / 2.0 else 0.002)
        stays += least < step / 2.0
    assert stays >= 1


def test_a_line_that_the_arm_can_follow_alone_leaves_the_rail_where_it_is() -> None:
    for name in ("ur5e", "kuka_kr16_2"):
        start = start_pose(name)
        requested = [JointWaypoint(STARTS[name]), PoseWaypoint(moved(start, 0.1), motion=LinearMotion())]
        still, both = (positions(ON_RAIL[name], *requested, prefer=prefer) for prefer in ("arm", "continuous"))
        assert still[1, 0] == pytest.approx(0.5, abs=1e-12)
        assert both[1, 0] > 0.55
