"""Document 002, the three-joint arm: kinematics, cubic coefficients, timeline and Table 3.1; errata E19 to E25."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from planner.kinematics import (
    Configuration,
    FloatArray,
    Pose,
    all_solutions,
    configurations,
    forward_kinematics,
    in_configuration,
    inverse_kinematics,
    workspace,
)
from planner.kinematics.options import InverseKinematicsOptions
from planner.planning import plan
from planner.plans.result import Plan
from planner.plans.tool_reports import line_polynomials
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.robots import Robot, load_robot
from tests.documents.published import document, gantry, homogeneous, modified_dh

DOCUMENT = document("three_dof_arm")
TABLE_1_2 = DOCUMENT["forward_kinematics"]["table_1_2"]["rows"]
TABLE_2_2 = DOCUMENT["inverse_kinematics"]["table_2_2"]["rows"]
MOVEMENT_SETS = {movement["name"]: movement for movement in DOCUMENT["movement_sets"]}
L1, L2 = 0.1, 0.17
D_H = [(0.0, 0.0, 0.0), (0.0, -np.pi / 2.0, 0.0), (L1, np.pi, 0.0)]
"""Rows of a (m), alpha (rad), d (m) of Table 1.1: modified D-H, with E20 corrected."""

OPTIONS = InverseKinematicsOptions()


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("three_dof_arm")


def position_of(q: FloatArray) -> FloatArray:
    """Return the tool position (3,), m, by a plain D-H product."""
    return (modified_dh(D_H, q) @ homogeneous(shift=(L2, 0.0, 0.0)))[:3, 3]


def closed_form(target: FloatArray) -> FloatArray:
    """Return (4, 3), rad: the four cases of Table 2.1, in full precision, theta1 by atan2 (E22)."""
    x, y, z = target
    r = np.linalg.norm(target)
    theta1, phi = np.arctan2(y, x), np.arctan2(-z, np.hypot(x, y))
    beta = np.arccos((L1**2 + r**2 - L2**2) / (2.0 * L1 * r))
    theta3 = np.arccos((r**2 - L1**2 - L2**2) / (2.0 * L1 * L2))
    up, down = phi + beta, phi - beta
    return np.array(
        [
            [theta1, up, theta3],
            [theta1, down, -theta3],
            [theta1 + np.pi, np.pi - up, -theta3],
            [theta1 + np.pi, np.pi - down, theta3],
        ]
    )


def apart(q: FloatArray, other: FloatArray) -> float:
    """Return the largest difference of two joint positions except whole turns, rad."""
    return float(np.abs(np.angle(np.exp(1j * (q - other)))).max())


E21 = {0: [222.23, 128.30, -50.0], 4: [-60.0, 103.92, -86.6]}
"""Corrected rows of Table 1.2: y 128.00 is 128.30, (-60.75, 105.22) is (-60.00, 103.92)."""


@pytest.mark.parametrize("i", range(5))
def test_table_1_2_with_e21_corrected(robot: Robot, i: int) -> None:
    row = TABLE_1_2[i]
    q = np.radians(row["q_deg"])
    ours = 1000.0 * forward_kinematics(robot, q[None])[0].position
    assert ours == pytest.approx(E21.get(i, row["published_calculated_mm"]), abs=6e-3)
    assert ours == pytest.approx(1000.0 * position_of(q), abs=1e-9)


def test_e19_equation_1_6_is_wrong_and_the_table_was_computed_with_the_right_one(robot: Robot) -> None:
    """y has cos(theta2 + theta3) in print, which gives 85.80 at (30, 30, 30)."""
    t = np.radians(30.0)
    printed = 170.0 * np.sin(t) * np.cos(t + t) + 100.0 * np.sin(t) * np.cos(t)
    assert printed == pytest.approx(85.80, abs=5e-3)
    assert 1000.0 * forward_kinematics(robot, np.full((1, 3), t))[0].position[1] == pytest.approx(128.30, abs=5e-3)


SOLUTIONS = [pytest.param(i, k, id=f"target-{i + 1}-case-{k + 1}") for i in range(5) for k in range(4)]


@pytest.mark.parametrize(("i", "k"), SOLUTIONS)
def test_table_2_2_as_published_and_in_full_precision(robot: Robot, i: int, k: int) -> None:
    """Table 2.2 is rounded to at most one decimal (and misprinted by up to 0.13 degrees: E23)."""
    target = np.array(TABLE_2_2[i]["target_m"])
    published = np.radians(TABLE_2_2[i]["published_solutions_deg"][k])
    exact = closed_form(target)[k]
    at_published, at_exact = (pose.position for pose in forward_kinematics(robot, np.array([published, exact])))
    assert np.linalg.norm(at_published - target) < 0.27e-3
    assert np.linalg.norm(at_exact - target) < 1e-15
    assert np.degrees(apart(published, exact)) < 0.14


@pytest.mark.parametrize(("i", "k"), SOLUTIONS)
def test_inverse_kinematics_returns_the_solution_near_the_reference(robot: Robot, i: int, k: int) -> None:
    target = np.array(TABLE_2_2[i]["target_m"])
    near = np.radians(TABLE_2_2[i]["published_solutions_deg"][k])
    result = inverse_kinematics(robot, Pose(target), OPTIONS, near)
    assert result.status == "solved"
    assert apart(result.position, closed_form(target)[k]) < 1e-9
    assert np.linalg.norm(position_of(result.position) - target) < 1e-9


@pytest.mark.parametrize("i", range(5))
def test_all_four_solutions_of_table_2_2_are_found(robot: Robot, i: int) -> None:
    target = np.array(TABLE_2_2[i]["target_m"])
    solutions = all_solutions(robot, Pose(target), OPTIONS)
    assert len(solutions) == 4
    for exact in closed_form(target):
        assert min(apart(exact, found) for found in solutions) < 1e-9


def test_workspace_is_a_hollow_sphere(robot: Robot) -> None:
    """From L2 - L1 = 70 mm to L1 + L2 = 270 mm about the base, open on no side."""
    found = workspace(robot, 1)
    reach = DOCUMENT["robot"]["computed_reach_mm"]
    assert [1000.0 * found.minimum_reach.value, 1000.0 * found.maximum_reach.value] == pytest.approx(
        [reach["min"], reach["max"]], abs=1e-9
    )
    assert found.minimum_radius.value == pytest.approx(0.0, abs=1e-9)
    heights = [found.minimum_height.value, found.maximum_height.value]
    assert heights == pytest.approx([-L1 - L2, L1 + L2], abs=1e-12)


def test_e22_theta_1_needs_atan2(robot: Robot) -> None:
    """acos(x / rho) gives +41.99 at the end of the first movement set, where y is negative."""
    end = np.array(MOVEMENT_SETS["first"]["end_m"])
    printed = np.degrees(np.arccos(end[0] / np.hypot(end[0], end[1])))
    result = inverse_kinematics(robot, Pose(end), OPTIONS, np.radians([-40.0, 60.0, 60.0]))
    assert printed == pytest.approx(41.99, abs=5e-3)
    assert np.degrees(result.position[0]) == pytest.approx(-41.99, abs=5e-3)


def there_and_back(movement: dict[str, Any]) -> Plan:
    """Plan a movement set as a straight Cartesian line with cubic time scaling.

    It rests for 10 s, moves there in 5 s, rests for 10 s and moves back in 5 s.
    """
    start, end = tuple(movement["start_m"]), tuple(movement["end_m"])
    waypoints = (
        JointWaypoint(position=start, dwell=10.0),
        JointWaypoint(position=end, duration=5.0, dwell=10.0),
        JointWaypoint(position=start, duration=5.0),
    )
    return plan(PlanningProblem(gantry(), waypoints))


@pytest.mark.parametrize("name", MOVEMENT_SETS)
@pytest.mark.parametrize(("direction", "piece"), [("forward", 1), ("reverse", 3)])
def test_tables_3_0_and_3_2_to_3_6_coefficients(name: str, direction: str, piece: int) -> None:
    trajectory = there_and_back(MOVEMENT_SETS[name]).trajectory
    published = MOVEMENT_SETS[name]["published_coefficients"][direction]
    for axis, row in zip("xyz", 1000.0 * trajectory.coefficients[piece], strict=True):
        assert row == pytest.approx(published[axis], abs=1e-12)


@pytest.mark.parametrize("name", MOVEMENT_SETS)
def test_e25_piecewise_polynomials_in_local_time(name: str) -> None:
    """Rest, there, rest, back; the reverse of the second and the z of the third set are misprinted too."""
    trajectory = there_and_back(MOVEMENT_SETS[name]).trajectory
    corrected = MOVEMENT_SETS[name]["corrected_piecewise"]
    assert trajectory.breakpoints[1:].tolist() == corrected["breakpoints_s"]
    for j, axis in enumerate("xyz"):
        for piece, expected in enumerate(corrected[axis][:4]):  # after 30 s: at rest again
            polynomial = expected if isinstance(expected, list) else [expected, 0.0, 0.0, 0.0]
            assert 1000.0 * trajectory.coefficients[piece, j] == pytest.approx(polynomial, abs=1e-12)


def test_e25_in_absolute_time_the_printed_polynomial_starts_300_mm_away() -> None:
    first = MOVEMENT_SETS["first"]
    printed = np.polynomial.polynomial.polyval(10.0, first["published_piecewise"]["x"][1])
    ours = 1000.0 * there_and_back(first).trajectory.evaluate(np.array([10.0]), [0])[0][0, 0]
    assert (printed, ours) == (pytest.approx(475.0), pytest.approx(175.0))


@pytest.mark.parametrize("name", MOVEMENT_SETS)
def test_peak_speed_and_acceleration(name: str) -> None:
    movement = MOVEMENT_SETS[name]
    trajectory = there_and_back(movement).trajectory
    speed, acceleration = (1000.0 * x for x in trajectory.evaluate(np.array([12.5, 10.0]), [1, 2]))
    assert speed[0] == pytest.approx(movement["computed_peak_speed_mm_s"], abs=1e-9)
    assert acceleration[1] == pytest.approx(movement["computed_peak_acceleration_mm_s2"], abs=1e-9)


def line_of_table_3_1() -> tuple[FloatArray, FloatArray]:
    """Return computed and printed positions (50, 3), m, at 0.1, 0.2, .. 5.0 s of the first forward move."""
    times = np.linspace(10.1, 15.0, 50)
    ours = there_and_back(MOVEMENT_SETS["first"]).trajectory.evaluate(times, [0])[0]
    return ours, np.array(DOCUMENT["table_3_1"]["rows"])[:, 1:] / 1000.0


def test_table_3_1_all_50_rows() -> None:
    """Printed in single precision."""
    ours, printed = line_of_table_3_1()
    assert printed.shape == (50, 3)
    assert 1000.0 * ours == pytest.approx(1000.0 * printed, abs=1e-4)


def test_table_3_1_is_solved_row_by_row_on_one_branch(robot: Robot) -> None:
    """Elbow up all along; neighbouring rows move no joint by more than 3 degrees."""
    targets, _ = line_of_table_3_1()
    q = closed_form(np.array(MOVEMENT_SETS["first"]["start_m"]))[0]
    for target in targets:
        result = inverse_kinematics(robot, Pose(target), OPTIONS, q)
        assert result.status == "solved"
        assert np.linalg.norm(position_of(result.position) - target) <= 1e-9
        assert apart(result.position, closed_form(target)[0]) < 1e-8
        assert np.degrees(np.abs(result.position - q)).max() < 3.0
        q = result.position


def test_table_3_1_as_a_linear_motion_of_the_arm(robot: Robot) -> None:
    """All 50 rows to 1e-4 mm, by a plain D-H product of the joints, which stay on the branch with the elbow up."""
    start, end = (np.array(MOVEMENT_SETS["first"][key]) for key in ("start_m", "end_m"))
    waypoints = (
        JointWaypoint(position=tuple(closed_form(start)[0].tolist()), dwell=10.0),
        PoseWaypoint(pose=Pose(end), duration=5.0, motion=LinearMotion(tolerance_position=5e-8)),
    )
    trajectory = plan(PlanningProblem(robot, waypoints)).trajectory
    times = np.linspace(10.1, 15.0, 50)
    printed = np.array(DOCUMENT["table_3_1"]["rows"])[:, 1:]
    for q, row in zip(trajectory.evaluate(times, [0])[0], printed, strict=True):
        assert 1000.0 * position_of(q) == pytest.approx(row, abs=1e-4)
        assert apart(q, closed_form(position_of(q))[0]) < 1e-8


@pytest.mark.parametrize("name", MOVEMENT_SETS)
def test_tables_3_0_and_3_2_to_3_6_as_polynomials_of_the_arms_own_lines(robot: Robot, name: str) -> None:
    """The 18 rows of coefficients, of plans in joint space; the corrected breakpoints of E25."""
    movement = MOVEMENT_SETS[name]
    start, end = (Pose(np.array(movement[key])) for key in ("start_m", "end_m"))
    waypoints = (
        PoseWaypoint(pose=start, dwell=10.0),
        PoseWaypoint(pose=end, duration=5.0, dwell=10.0, motion=LinearMotion()),
        PoseWaypoint(pose=start, duration=5.0, motion=LinearMotion()),
    )
    lines = line_polynomials(plan(PlanningProblem(robot, waypoints)))
    assert [line.breakpoints.tolist() for line in lines] == [[10.0, 15.0], [25.0, 30.0]]
    for line, direction in zip(lines, ("forward", "reverse"), strict=True):
        published = movement["published_coefficients"][direction]
        assert 1000.0 * line.position[0] == pytest.approx(np.array([published[axis] for axis in "xyz"]), abs=1e-9)
        assert line.deviation < 1e-4


@pytest.mark.parametrize("name", MOVEMENT_SETS)
def test_timeline_of_the_arm_itself(robot: Robot, name: str) -> None:
    """Ten seconds at the start, five there, ten at the end, five back, by positions alone."""
    start, end = (Pose(np.array(MOVEMENT_SETS[name][key])) for key in ("start_m", "end_m"))
    waypoints = (
        PoseWaypoint(pose=start, dwell=10.0),
        PoseWaypoint(pose=end, duration=5.0, dwell=10.0),
        PoseWaypoint(pose=start, duration=5.0),
    )
    result = plan(PlanningProblem(robot, waypoints))
    assert result.trajectory.arrivals.tolist() == [0.0, 15.0, 30.0]
    assert result.trajectory.departures.tolist() == [10.0, 25.0, 30.0]
    assert result.certificate.satisfied
    for time, pose in ((0.0, start), (10.0, start), (15.0, end), (25.0, end), (30.0, start)):
        position, velocity = result.trajectory.evaluate(np.array([time]), [0, 1])
        assert position_of(position[0]) == pytest.approx(pose.position, abs=1e-6)
        assert np.abs(velocity).max() < 1e-12


def test_the_real_arm_has_case_1_in_all_that_is_shown_of_it(robot: Robot) -> None:
    """Section 2: of the four cases only the first is within its ranges, which are not published; angles span less."""
    assert "not published" in robot.source
    assert not np.isfinite(robot.limit("lower")).any()
    assert not np.isfinite(robot.limit("upper")).any()
    case_1 = Configuration("right", "up")
    shown = [np.array(row["q_deg"], dtype=float) for row in TABLE_1_2]
    shown += [np.array(row["published_solutions_deg"][0]) for row in TABLE_2_2]
    for movement in MOVEMENT_SETS.values():
        for end in ("start_m", "end_m"):
            solutions = all_solutions(robot, Pose(np.array(movement[end])), OPTIONS)
            (of_the_arm,) = in_configuration(robot, solutions, case_1)
            shown.append(np.degrees(of_the_arm))
    assert set(configurations(robot, np.radians(shown))) == {case_1}
    assert np.min(shown, axis=0) == pytest.approx([-42.0, 30.0, 30.0], abs=0.1)
    assert np.max(shown, axis=0) == pytest.approx([135.0, 148.2, 145.7], abs=0.1)
