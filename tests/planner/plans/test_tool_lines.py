"""Straight lines as polynomials of time, against the forward kinematics of the planned trajectories."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from planner.backends import BACKENDS
from planner.kinematics import FloatArray, Pose, forward_kinematics
from planner.limits import Limits
from planner.planning import plan
from planner.plans.tool_reports import LinePolynomial, line_polynomials
from planner.problems.moves import CartesianMove
from planner.problems.problem import (
    AnyWaypoint,
    CircularMotion,
    JointWaypoint,
    LinearMotion,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
)
from planner.problems.transitions import BlendTransition, ThroughTransition
from planner.robots import load_robot
from planner.spatial import rotation_z
from tests.planner.problems_of_tests import backend_of

ROBOT = load_robot("kuka_kr16_l6_2")
START = JointWaypoint([0.3, -1.2, 1.4, 0.2, 0.6, 0.1])
every_back_end = pytest.mark.parametrize("kind", BACKENDS)


def line(x: float, y: float, z: float, turn: float = 0.0, **more: object) -> RelativeWaypoint:
    move = CartesianMove((x, y, z), rotation_z(turn))
    return RelativeWaypoint(move=move, frame="base", motion=LinearMotion(), **more)  # type: ignore[arg-type]


def value(line: LinePolynomial, t: float, derivative: int = 0) -> FloatArray:
    """Evaluate the line (3,), m, by numpy's polynomials."""
    piece = min(int(np.searchsorted(line.breakpoints, t, side="right")) - 1, len(line.breakpoints) - 2)
    since = t - line.breakpoints[piece]
    return np.array([np.polynomial.Polynomial(row).deriv(derivative)(since) for row in line.position[piece]])


def tool(problem: PlanningProblem, q: FloatArray) -> FloatArray:
    """Compute the position of the tool (3,), m, by Pinocchio."""
    model, data = problem.robot.model, problem.robot.model.createData()
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[problem.robot.tool_frame_id].translation.copy()


@pytest.mark.long_table
@every_back_end
def test_the_tool_of_the_joint_trajectory_is_where_the_polynomials_say(kind: str) -> None:
    """Lines with stops, a blend and a turn: at 400 times, within the stated deviation, itself within the tolerance."""
    waypoints: tuple[AnyWaypoint, ...] = (
        START,
        line(0.0, -0.3, 0.0),
        line(0.0, 0.0, -0.3, turn=0.4, transition=BlendTransition(0.05)),
        line(0.1, 0.2, 0.0, dwell=0.5),
    )
    problem = PlanningProblem(ROBOT, waypoints, Limits(tcp_linear_velocity=0.25))
    planned = plan(problem, backend_of(kind))
    lines = line_polynomials(planned)
    assert [line.segment for line in lines] == [0, 1, 2]
    for line_ in lines:
        assert line_.deviation < 1e-4
        times = np.linspace(line_.breakpoints[0], line_.breakpoints[-1], 400)
        joints = planned.trajectory.evaluate(np.minimum(times, planned.trajectory.duration), [0])[0]
        apart = [np.linalg.norm(tool(problem, q) - value(line_, t)) for q, t in zip(joints, times, strict=True)]
        assert max(apart) <= 1.01 * line_.deviation + 1e-9
        assert (np.diff(line_.breakpoints) > 0.0).all()
    first, before, after = lines
    assert (first.breakpoints[0], after.breakpoints[-1]) == (0.0, pytest.approx(planned.trajectory.duration - 0.5))
    corner = planned.path.waypoints[2].pose.position  # the blend is no part of either line
    assert np.linalg.norm(value(before, before.breakpoints[-1]) - corner) > 0.01
    assert np.linalg.norm(value(after, after.breakpoints[0]) - corner) > 0.01


@pytest.mark.long_table
@every_back_end
@pytest.mark.parametrize("seed", range(3))
def test_pieces_join_and_the_way_is_straight(kind: str, seed: int) -> None:
    """Random lines go from start to end, at rest at both, without jumps of position or speed, and stay on the line."""
    rng = np.random.default_rng(seed)
    waypoints = (START, line(*rng.uniform(-0.2, 0.2, 3), turn=0.3))
    planned = plan(PlanningProblem(ROBOT, waypoints), backend_of(kind))
    (found,) = line_polynomials(planned)
    start, end = (forward_kinematics(ROBOT, [q])[0].position for q in planned.path.positions)
    for t, place in ((0.0, start), (found.breakpoints[-1], end)):
        assert value(found, t) == pytest.approx(place, abs=1e-8)
        assert value(found, t, 1) == pytest.approx(np.zeros(3), abs=1e-6)
    lengths = np.diff(found.breakpoints)
    for i in range(len(lengths) - 1):
        for order in (0, 1):
            before, after = (
                [np.polynomial.Polynomial(row).deriv(order)(t) for row in found.position[k]]
                for k, t in ((i, lengths[i]), (i + 1, 0.0))
            )
            assert after == pytest.approx(before, abs=1e-6)
    for t in np.linspace(0.0, found.breakpoints[-1], 50):
        way = value(found, t) - start
        assert np.linalg.norm(np.cross(way, end - start)) / np.linalg.norm(end - start) < 1e-9


@pytest.mark.parametrize(("kind", "pieces", "degree"), [("cubic", 1, 3), ("quintic", 1, 5), ("trapezoidal", 3, 2)])
def test_the_law_has_as_many_pieces_as_phases(kind: str, pieces: int, degree: int) -> None:
    planned = plan(PlanningProblem(ROBOT, (START, line(0.0, -0.4, 0.1))), backend_of(kind))
    (found,) = line_polynomials(planned)
    assert len(planned.trajectory.lengths) > pieces  # of the joints there are more
    assert found.path_parameter.shape == (pieces, degree + 1)


def test_a_turn_on_the_spot_is_a_line_that_goes_nowhere() -> None:
    planned = plan(PlanningProblem(ROBOT, (START, line(0.0, 0.0, 0.0, turn=0.5))))
    (found,) = line_polynomials(planned)
    place = forward_kinematics(ROBOT, [START.position])[0].position
    assert found.position[0] == pytest.approx(np.column_stack([place, np.zeros((3, 3))]), abs=1e-9)
    duration = planned.trajectory.duration
    assert found.path_parameter[0] == pytest.approx([0.0, 0.0, 3.0 / duration**2, -2.0 / duration**3])


def test_joint_motions_circles_and_lines_without_length_have_none() -> None:
    here = forward_kinematics(ROBOT, [START.position])[0]
    via, end = (Pose(here.position + np.array(way), here.rotation) for way in ([0.1, 0.0, 0.05], [0.2, 0.0, 0.0]))
    circle = PoseWaypoint(end, motion=CircularMotion(via))
    waypoints = (START, line(0.0, 0.0, 0.0), circle, JointWaypoint(START.position))
    assert line_polynomials(plan(PlanningProblem(ROBOT, waypoints))) == []


@pytest.mark.parametrize("length", [1e-6, 1e-4, 0.01])
def test_short_lines(length: float) -> None:
    planned = plan(PlanningProblem(ROBOT, (START, line(length, 0.0, 0.0))))
    (found,) = line_polynomials(planned)
    duration = planned.trajectory.duration
    assert found.path_parameter[0] == pytest.approx([0.0, 0.0, 3.0 / duration**2, -2.0 / duration**3], rel=1e-6)


def test_lines_that_are_passed_without_a_stop_hand_over_their_speed() -> None:
    """Two halves of one line equal the one line: its cubic, cut in two."""
    half = line(0.0, -0.2, 0.0)
    problem = PlanningProblem(ROBOT, (START, replace(half, transition=ThroughTransition()), half))
    first, second = line_polynomials(plan(problem))
    assert first.breakpoints[-1] == second.breakpoints[0]
    for order in (0, 1):
        meet = value(first, first.breakpoints[-1], order), value(second, second.breakpoints[0], order)
        assert meet[0] == pytest.approx(meet[1], abs=1e-7)
