"""Polylines, splines and circles with any turns in proofs, against scipy and dense samples of the paths."""

from __future__ import annotations

import copy
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

import planner
from planner.proofs import check_proof, write_proof
from planner.proofs.guides import NODES
from planner.proofs.polynomial_paths import PolynomialPath
from planner.tool_motions.polylines import Polyline
from tests.planner.proofs.guided_poses import pose_at
from tests.planner.proofs.verdicts import is_rejected

if TYPE_CHECKING:
    from planner.spatial import FloatArray

IN_FULL = partial(pytest.param, marks=pytest.mark.large_only)
"""A case that the quick tests leave to CI."""

START = (0.2, -1.4, 1.6, -1.5, -1.4, 0.1)
"""Joint positions of a UR5e with the tool in front of it, rad."""

FOLLOWED = "path_deviation: polynomials follow the path of segment 0 within 1e-9 m and rad, as compared at points"


def pose_near(shift: tuple[float, float, float], turn: tuple[float, float, float]) -> planner.Pose:
    start = planner.forward_kinematics(planner.load_robot("ur5e"), START)
    assert start.rotation is not None
    return planner.Pose(start.position + np.array(shift), start.rotation @ Rotation.from_rotvec(turn).as_matrix())


VIA = [pose_near((0.03, 0.0, 0.05), (0.1, 0.2, 0.0)), pose_near((0.06, 0.05, 0.02), (0.0, -0.2, 0.1))]
END = pose_near((0.1, 0.0, 0.0), (0.1, 0.1, 0.1))


def proof_of(motion: Any, backend: planner.BackEnd) -> dict[str, Any]:
    robot = planner.load_robot("ur5e")
    waypoints: list[planner.AnyWaypoint] = [planner.JointWaypoint(START), planner.PoseWaypoint(END, motion=motion)]
    return write_proof(planner.plan(planner.PlanningProblem(robot, waypoints), backend))


def test_guides_follow_a_polyline() -> None:
    line = Polyline.through(pose_near((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), VIA, END, 0.01)
    path = PolynomialPath.of(line.poses, line.breakpoints)
    assert path is not None
    u = np.linspace(0.0, 1.0, 20_001)
    positions, rotations = line.poses(u)
    assert rotations is not None
    for guide in path.guides:
        for share in (0.0, 0.37, 1.0):
            point, rotation = pose_at(guide, share)
            nearest = int(np.linalg.norm(positions - point, axis=1).argmin())
            assert np.linalg.norm(positions[nearest] - point) < 1e-5
            assert Rotation.from_matrix(rotations[nearest].T @ rotation).magnitude() < 1e-4


@pytest.mark.large_only
def test_guides_of_a_spline_are_that_of_scipy() -> None:
    """The parameter of the spline is the length of the chords."""
    proof = proof_of(planner.SplineMotion(VIA), planner.Quintic())
    start = planner.forward_kinematics(planner.load_robot("ur5e"), START)
    points = np.array([start.position, *(via.position for via in VIA), END.position])
    chords = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    spline = CubicSpline(chords, points, bc_type="natural")
    samples: FloatArray = spline(np.linspace(0.0, chords[-1], 50_001))
    for guide in proof["statement"]["limits"]["path_deviation"][0]["guides"]:
        for share in (0.0, 0.5, 1.0):
            point, _ = pose_at(guide, share)
            assert np.linalg.norm(samples - point, axis=1).min() < 3e-6


def test_the_nearest_parts_are_tried_first() -> None:
    line = Polyline.through(pose_near((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), VIA, END, 0.01)
    path = PolynomialPath.of(line.poses, line.breakpoints)
    assert path is not None
    for middle in (0.1, 0.3, 0.52, 0.9):
        points, _ = line.poses(middle + 1e-4 * NODES)
        part, *shares = path.choices(points)[0]
        for x, point in zip(NODES, points, strict=True):
            found, _ = pose_at(path.guides[int(part)], float(np.polyval(shares[::-1], x)))
            np.testing.assert_allclose(found, point, atol=2e-9)


def test_a_line_in_a_tolerance_region_is_proved() -> None:
    motion = planner.LinearMotion(free=planner.Region(rotation_x=(-0.3, 0.3), rotation_z=(-3.1416, 3.1416)))
    proof = proof_of(motion, planner.Trapezoidal())
    assert "path_deviation" in check_proof(proof)
    assert proof["statement"]["not_covered"] == [FOLLOWED.replace("the path", "poses in the tolerance region")]
    proof["statement"]["robots"][0]["tool"]["translation"][2] += 0.01
    proof["statement"]["claims"].remove("waypoints")
    assert is_rejected(proof)


@pytest.mark.parametrize(
    ("motion", "backend"),
    [
        pytest.param(planner.PolylineMotion(VIA, blend=0.01), planner.Quintic(), id="polyline"),
        IN_FULL(planner.SplineMotion(VIA), planner.Quintic(), id="spline"),
        IN_FULL(planner.CircularMotion(via=VIA[0]), planner.Quintic(), id="circle that turns about several axes"),
    ],
)
def test_curves_are_proved_and_others_rejected(motion: Any, backend: planner.BackEnd) -> None:
    proof = proof_of(motion, backend)
    assert "path_deviation" in check_proof(proof)
    assert proof["statement"]["not_covered"] == [FOLLOWED]
    numbers = {along[0] for along in proof["evidence"]["along"]}
    path = proof["statement"]["limits"]["path_deviation"][0]
    assert numbers == set(range(len(path["guides"])))
    elsewhere = copy.deepcopy(proof)
    guide = elsewhere["statement"]["limits"]["path_deviation"][0]["guides"][len(path["guides"]) // 2]
    guide["links"][0]["origin"][2] += 3.0 * path["tolerance"][0] ** 0.5
    assert is_rejected(elsewhere)
    bent = copy.deepcopy(proof)
    guide = bent["statement"]["limits"]["path_deviation"][0]["guides"][0]
    ways = [sum(rates) for rates in guide["rates"][:3]]
    longest = int(np.abs(ways).argmax())
    guide["rates"][(longest + 1) % 3][1] += 0.2 * abs(ways[longest])  # the quadratic term
    assert is_rejected(bent)
    other = copy.deepcopy(proof)
    other["evidence"]["along"][0][0] = len(path["guides"]) - 1
    assert is_rejected(other)
