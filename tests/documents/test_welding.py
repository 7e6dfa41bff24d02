"""Document 001, welding: eleven points from ten relative moves, with errata E14 to E18."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from planner.kinematics import FloatArray, Pose, forward_kinematics, inverse_kinematics, jacobian
from planner.kinematics.options import InverseKinematicsOptions
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.moves import CartesianMove, CylindricalMove, Move, SphericalMove
from planner.problems.problem import LinearMotion, PlanningProblem, PoseWaypoint, RelativeWaypoint
from planner.robots import load_robot
from tests.documents.published import angle_between, document, homogeneous, pose_of, standard_dh

MOVES = document("welding")["moves"]
POINTS = document("welding")["points"]

BASE_HEIGHT = 0.675
"""m; the document gives none, and point 1 cannot be reached without it (E18)."""

D_H = [(0, 0.45, 90), (0, 0.68, 0), (0, 0, 90), (0.7, 0, -90), (0, 0, 90), (0, 0, 0)]
"""Rows of d (m), a (m), alpha (degrees): Table I with the lengths of document 000, repaired like its arm (E18)."""


def move_of(parameters: dict[str, float], kind: str) -> Move:
    """Return the move of Table II, from its printed parameters."""
    angle = {key[:-4]: float(np.radians(value)) for key, value in parameters.items() if key.endswith("_deg")}
    if kind == "cylindrical":
        return CylindricalMove(r=parameters["r_m"], l=parameters["l_m"], **angle)
    if kind == "spherical":
        return SphericalMove(r=parameters["r_m"], **angle)
    return CartesianMove((parameters["dx_m"], parameters["dy_m"], parameters["dz_m"]))


def waypoints() -> tuple[PoseWaypoint | RelativeWaypoint, ...]:
    home = PoseWaypoint(name="1", pose=pose_of(np.array(POINTS[0]["published_T"], dtype=float)))
    relative = (
        RelativeWaypoint(name=str(m["to_point"]), frame="tool", move=move_of(m["parameters"], m["type"])) for m in MOVES
    )
    return home, *relative


def reached(q: FloatArray) -> FloatArray:
    """Return the tool transform (4, 4) by a plain D-H product."""
    base = homogeneous(shift=(0.0, 0.0, BASE_HEIGHT))
    return base @ standard_dh([(d, a, np.radians(alpha)) for d, a, alpha in D_H], q)


@pytest.fixture(scope="module")
def welding() -> Plan:
    return plan(PlanningProblem(load_robot("welding_arm"), waypoints()))


@pytest.mark.parametrize("move", MOVES, ids=lambda move: f"{move['from_point']}-{move['to_point']}")
def test_move_has_the_matrix_of_its_parameters(move: dict[str, Any]) -> None:
    """Moves 7-8 and 9-10 are misprinted (E14, E15); the parameters are right."""
    rotation, translation = move_of(move["parameters"], move["type"]).transform()
    ours = np.column_stack([rotation, translation])
    assert ours == pytest.approx(np.array(move["computed_T"])[:3], abs=1e-9)
    wrong = np.abs(ours - np.array(move["published_T"])[:3]) > 5.1e-5
    misprints = {(7, 8): {(0, 1)}, (9, 10): {(0, 2), (2, 2)}}  # E14, E15
    expected = misprints.get((move["from_point"], move["to_point"]), set())
    assert set(zip(*(index.tolist() for index in np.nonzero(wrong)), strict=True)) == expected


@pytest.mark.parametrize("i", range(11), ids=lambda i: f"point-{i + 1}")
def test_point_is_reached_from_the_moves_with_e14_and_e15_corrected(welding: Plan, i: int) -> None:
    expected = np.array(POINTS[i]["computed_T"])
    T = reached(welding.path.waypoints[i].position)
    assert np.linalg.norm(T[:3, 3] - expected[:3, 3]) < 1e-6
    assert angle_between(T[:3, :3], expected[:3, :3]) < 1e-6


@pytest.mark.parametrize(
    ("i", "tolerance"),
    [(0, 1e-6), (1, 7.1e-5), (2, 7.1e-5), (3, 7.1e-5), (4, 7.1e-5), (5, 2.5e-3), (6, 2.5e-3)],
    ids=lambda value: f"point-{value + 1}" if isinstance(value, int) else None,
)
def test_point_equals_the_printed_one_as_far_as_the_document_is_right(welding: Plan, i: int, tolerance: float) -> None:
    """Points 6 and 7 carry the rounding of E17's misprinted first column; from point 8 on E14 spoils the rotation."""
    T = reached(welding.path.waypoints[i].position)
    assert pytest.approx(np.array(POINTS[i]["published_T"], dtype=float), abs=tolerance) == T


@pytest.mark.parametrize("i", range(7, 11), ids=lambda i: f"point-{i + 1}")
def test_e14_and_e15_printed_points_8_to_11_are_no_poses(welding: Plan, i: int) -> None:
    printed = np.array(POINTS[i]["published_T"], dtype=float)[:3, :3]
    assert np.linalg.det(printed) < 0.35
    assert np.linalg.det(reached(welding.path.waypoints[i].position)[:3, :3]) == pytest.approx(1.0, abs=1e-12)


def test_e16_final_transform(welding: Plan) -> None:
    R = [[-0.2931, -0.9497, -0.1103], [0.9249, -0.2524, -0.2844], [0.2423, -0.1854, 0.9523]]
    T = reached(welding.path.waypoints[-1].position)
    assert T[:3, :3] == pytest.approx(np.array(R), abs=5.1e-5)
    assert T[:3, 3] == pytest.approx([-0.2150, 1.0994, 0.8455], abs=5.1e-5)


def test_relative_waypoints_and_poses_are_one_plan(welding: Plan) -> None:
    """The eleven computed points as poses lead through the same joint positions."""
    poses = tuple(
        PoseWaypoint(pose=Pose(np.array(p["computed_T"])[:3, 3], np.array(p["computed_T"])[:3, :3])) for p in POINTS
    )
    absolute = plan(PlanningProblem(load_robot("welding_arm"), poses))
    assert absolute.path.positions == pytest.approx(welding.path.positions, abs=1e-6)


def test_e18_home_cannot_be_reached_without_a_base_height() -> None:
    """The refuelling arm is the welding arm without one."""
    home = pose_of(np.array(POINTS[0]["computed_T"]))
    result = inverse_kinematics(load_robot("ngv_refuelling_arm"), home, InverseKinematicsOptions())
    assert result.status == "unreachable_waypoint"


def test_plan_is_certified(welding: Plan) -> None:
    assert welding.certificate.satisfied
    assert len(welding.path.waypoints) == 11


def straight(robot_id: str) -> tuple[PoseWaypoint | RelativeWaypoint, ...]:
    """Return the sequence with a straight line to every point except the first."""
    first, *others = waypoints()
    return first, *(replace(waypoint, motion=LinearMotion()) for waypoint in others)


@pytest.mark.parametrize("robot_id", ["welding_arm", "kuka_kr16_l6_2"])
def test_the_sequence_as_linear_motions(robot_id: str) -> None:
    """On the repaired arm and on a real one, to 0.1 mm and on one branch all the way."""
    robot = load_robot(robot_id)
    result = plan(PlanningProblem(robot, straight(robot_id)))
    expected = [np.array(point["computed_T"])[:3, 3] for point in POINTS]
    signs = set()
    for segment, (start, end) in enumerate(pairwise(expected)):
        length = np.linalg.norm(end - start)
        way = (end - start) / length if length > 0.0 else np.zeros(3)  # some moves only turn the torch
        times = np.linspace(result.trajectory.arrivals[segment], result.trajectory.arrivals[segment + 1], 60)
        for q in result.trajectory.evaluate(times, [0])[0]:
            offset = forward_kinematics(robot, q[None])[0].position - start
            assert np.linalg.norm(offset - (offset @ way) * way) <= 1e-4
            signs.add(float(np.sign(np.linalg.det(jacobian(robot, q)))))
    assert len(signs) == 1
    if robot_id == "welding_arm":  # by a plain D-H product
        for q, point in zip(result.path.positions, expected, strict=True):
            assert np.linalg.norm(reached(q)[:3, 3] - point) < 1e-6
