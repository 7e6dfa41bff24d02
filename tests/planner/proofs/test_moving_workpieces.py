"""Proofs where the workpiece moves, against Pinocchio's models of the arm and the positioner in the world."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.proofs import check_proof, write_proof
from planner.spatial import FloatArray, Pose
from tests.planner.proofs.verdicts import is_rejected
from tests.planner.robots.held_parts import HeldPart
from tests.planner.robots.two_branches import TwoBranches, se3

PLATE = Pose([0.0, 0.0, 0.1], np.eye(3))
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2.0
PART, POST = np.array([0.2, 0.2, 0.06]), np.array([0.1, 0.1, 0.5])
ON_PART = Pose([0.0, 0.0, -0.03])
ARM = planner.load_robot("kuka_kr16_2")
TURN = planner.ExternalAxis("turn", "revolute", (0, 0.2, 1), Pose([1.1, 0.0, 0.5], np.eye(3)), -3.0, 3.0, 1.0, 2.0)
CELLS: dict[str, HeldPart | TwoBranches] = {
    "fixed tool": HeldPart(ARM, Pose.from_rpy([1.25, 0.3, 0.9], [0.0, -1.5, 0.0]), Pose([0.0, 0.0, 0.12], np.eye(3))),
    "positioner": TwoBranches(ARM.derived(tool=Pose.from_rpy([0.1, 0.0, 0.3], [0.0, 0.6, 0.0])), [TURN], PLATE),
}
PLACES = {"fixed tool": Pose([1.3, -0.5, 0.3]), "positioner": Pose([1.1, 0.8, 0.3])}


def scene_of(name: str, *further: planner.SceneObject) -> planner.Scene:
    part = planner.AttachedObject("part", [planner.Box(PART)], ON_PART, "workpiece", ["link_6"])
    return planner.Scene([planner.SceneObject("post", [planner.Box(POST)], PLACES[name]), *further], [part])


def plan_of(name: str, scene: planner.Scene) -> planner.Plan:
    """Plan a line of the tool on the workpiece, which turns on the positioner."""
    speed = planner.Limits(tcp_linear_velocity=0.2)
    start, end = (Pose.from_rpy([0.08, y, 0.02], [np.pi, 0.0, np.pi]) for y in (-0.06, 0.06))
    angles = ({"turn": angle} if name == "positioner" else {} for angle in (0.0, 0.5))
    line = planner.LinearMotion()
    waypoints = [
        planner.PoseWaypoint(start, external=next(angles)),
        planner.PoseWaypoint(end, motion=line, limits=speed, external=next(angles)),
    ]
    return planner.plan(planner.PlanningProblem(CELLS[name].robot, waypoints, scene=scene), planner.Toppra())


@pytest.fixture(scope="module", params=[pytest.param("positioner", marks=pytest.mark.large_only), "fixed tool"])
def case(request: pytest.FixtureRequest) -> tuple[str, planner.Plan, dict[str, Any]]:
    name = request.param
    made = plan_of(name, scene_of(name))
    return name, made, write_proof(made)


def chain_of(statement: dict[str, Any], q: FloatArray) -> list[pin.SE3]:
    """Return the frames of the chain in the statement, the base first."""
    frames = [pin.SE3.Identity()]
    for link, position in zip(statement["robots"][0]["links"], q, strict=True):
        about, along = (position, 0.0) if link["motion"] == "revolute" else (0.0, position)
        motion = pin.SE3(pin.exp3(np.array([0.0, 0.0, about])), np.array([0.0, 0.0, along]))
        frames.append(frames[-1] * pin.SE3(np.array(link["rotation"]), np.array(link["origin"])) * motion)
    return frames


def workpiece_of(cell: HeldPart | TwoBranches, q: FloatArray) -> pin.SE3:
    return cell.part(q) if isinstance(cell, HeldPart) else cell.links(q)[-1] * se3(cell.workpiece)


def test_proofs_cover_joints_paths_and_clearance_but_no_torque(case: tuple[Any, ...]) -> None:
    _, made, proof = case
    claims = check_proof(proof)
    covered = {
        "position",
        "velocity",
        "acceleration",
        "tcp_linear_velocity",
        "path_deviation",
        "clearance",
        "waypoints",
    }
    assert covered <= set(claims)
    assert "torque: the workpiece moves" in proof["statement"]["not_covered"]
    assert "torque" not in claims
    assert not any(link["mass"] for link in proof["statement"]["robots"][0]["links"])
    assert len(made.certificate.checks) > len(claims)


def test_the_statement_has_the_shapes_and_the_tool_of_the_world(case: tuple[Any, ...]) -> None:
    """Part, post and tool stand to each other as the separate models of arm and positioner have them."""
    name, made, proof = case
    cell, statement = CELLS[name], proof["statement"]
    shapes = {shape["name"]: shape for shape in statement["scenes"][0]["shapes"]}
    tool = statement["robots"][0]["tool"]
    for q in made.trajectory.evaluate(np.linspace(0.0, made.trajectory.duration, 7), [0])[0]:
        frames = chain_of(statement, q)
        found = [frames[shapes[one]["joint"]] for one in ("part", "post")]
        points = [
            np.array(shapes[one]["points"]) @ at.rotation.T + at.translation
            for one, at in zip(("part", "post"), found, strict=True)
        ]
        true = [workpiece_of(cell, q).act(x) for x in CORNERS * PART + ON_PART.position]
        apart = np.linalg.norm(points[0][:, None] - points[1], axis=2)
        expected = np.linalg.norm(np.array(true)[:, None] - (CORNERS * POST + PLACES[name].position), axis=2)
        np.testing.assert_allclose(np.sort(apart.ravel()), np.sort(expected.ravel()), atol=1e-9)
        placed = frames[tool["joint"]] * pin.SE3(np.array(tool["rotation"]), np.array(tool["translation"]))
        in_workpiece = cell.tool_in_part(q) if isinstance(cell, HeldPart) else cell.tool_in_workpiece(q)
        np.testing.assert_allclose(placed.homogeneous, in_workpiece.homogeneous, atol=1e-9)


def test_tampered_proofs_are_rejected(case: tuple[Any, ...]) -> None:
    _, _, proof = case
    statement = proof["statement"]
    slower, wider, nearer = (copy.deepcopy(proof) for _ in range(3))
    limits = slower["statement"]["limits"]["tcp_linear_velocity"]
    limits[:] = [limit and 0.9 * limit for limit in limits]
    wider["statement"]["limits"]["path_deviation"][-1]["tolerance"][0] *= 1e-16
    names = [shape["name"] for shape in statement["scenes"][0]["shapes"]]
    for pair in nearer["statement"]["scenes"][0]["clearance"]:
        pair[2] += 1.5 if {names[k] for k in pair[:2]} == {"part", "post"} else 0.0
    assert [is_rejected(one) for one in (proof, slower, wider, nearer)] == [False, True, True, True]


@pytest.mark.large_only
def test_half_spaces_leave_the_clearance_out() -> None:
    floor = planner.SceneObject("floor", [planner.HalfSpace([0.0, 0.0, 1.0], -0.5)])
    proof = write_proof(plan_of("fixed tool", scene_of("fixed tool", floor)))
    assert "clearance" not in check_proof(proof)
    assert "clearance: a half space stands behind joints that move the workpiece" in proof["statement"]["not_covered"]


def test_limits_of_the_tool_hold_within_following_errors_under_a_fixed_tool() -> None:
    """A limit between the largest speeds of planned and of actual positions holds for planned ones only."""
    cell, home = CELLS["fixed tool"], [0.0, 1.0, 0.0, 1.2, -1.3, 0.3]
    robot = cell.robot.derived(limits={name: {"following_error": 2e-3} for name in cell.robot.joint_names})
    speed = planner.Limits(tcp_linear_velocity=0.3)
    made = planner.plan(planner.PlanningProblem(robot, [home, np.add(home, 0.1)], speed), planner.Trapezoidal())
    q, v = made.trajectory.evaluate(np.linspace(0.0, made.trajectory.duration, 200), [0, 1])
    errors = 2e-3 * np.random.default_rng(3).choice([-1.0, 0.0, 1.0], (10, *q.shape))
    rows = [
        np.linalg.norm([cell.rates(*state)[0] for state in zip(x, v, strict=True)], axis=1) for x in [q, *q + errors]
    ]
    proof = write_proof(made)
    assert "tcp_linear_velocity" in check_proof(proof)
    missing = {"torque_with_tolerances", "following errors: waypoints hold for planned positions"}
    assert missing <= set(proof["statement"]["not_covered"])
    proof["evidence"]["bounded"] = np.linspace(0.0, len(made.trajectory.lengths), 301).tolist()
    assert not is_rejected(proof)
    proof["statement"]["limits"]["tcp_linear_velocity"] = [float(rows[0].max() + np.max(rows)) / 2.0]
    assert is_rejected(proof)
    for each in proof["statement"]["robots"]:
        each["following_errors"] = [0.0] * robot.dof
    assert not is_rejected(proof)
