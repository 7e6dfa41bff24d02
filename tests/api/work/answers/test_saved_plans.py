"""A saved plan is the plan, in every form and to the last bit."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

import planner
from api.contract.requests import PlanRequest
from api.work.answers.formats import FORMATS
from api.work.answers.plans import AnswerOptions
from api.work.answers.saved_plans import OF_THE_PATH, load_plan, save_plan
from api.work.conversion.problems import to_backend, to_planning_problem
from planner.planning import plan
from planner.problems.blend_radii import blend_radii
from planner.robots import load_robot
from tests.api.requests import PARTS
from tests.locations import ROOT
from tests.planner.every_bit import every_bit
from tests.planner.free_motion.cases import ARM, LEFT, RIGHT, WALL
from tests.planner.planning.blend_cases import BESIDE_A_LINE, along_a_rectangle, ball_at

CASES = {
    "blend_beside_a_post.json": {"include": sorted(OF_THE_PATH)},
    "blended_lines.json": {"include": list(PARTS), "limits": {"tcp_linear_velocity": 0.2}},
    "refuelling_case_1_poses.json": {},
    "named_configuration.json": {"backend": {"kind": "toppra", "jerk_limited": True}},
    "blended_lines.json by the package": {"backend": {"kind": "toppra", "solver": "package"}},
    "elbow_saves_time.json": {"include": sorted(OF_THE_PATH)},
    "on_a_pallet.json": {"payload": {"mass": 1.0}, "include": ["torque"]},
}


@pytest.mark.long_table
@pytest.mark.parametrize("name", CASES)
def test_every_form_of_a_loaded_plan_is_that_of_the_plan(name: str) -> None:
    document: dict[str, Any] = json.loads((ROOT / "examples" / name.split()[0]).read_text()) | CASES[name]
    request = TypeAdapter(PlanRequest).validate_json(json.dumps(document))
    problem, backend = to_planning_problem(request, load_robot(request.robot)), to_backend(request.backend)
    made = plan(problem, backend)
    saved = save_plan(made)
    assert len(saved) < 1000 + 8 * made.trajectory.coefficients.size + 300 * len(made.path.waypoints)
    loaded = load_plan(saved, problem, backend, with_groups=not OF_THE_PATH.isdisjoint(request.include))
    options = AnswerOptions(request.sample_period, frozenset(request.include))
    for form in ("json", "csv", "ros2", "msgpack"):
        assert FORMATS[form].render(loaded, options) == FORMATS[form].render(made, options)
    np.testing.assert_array_equal(loaded.trajectory.breakpoints, made.trajectory.breakpoints)
    assert loaded.certificate == made.certificate
    assert loaded.warnings == made.warnings


LEFT_OF_WALL, RIGHT_OF_WALL = planner.JointWaypoint(LEFT), planner.JointWaypoint(RIGHT, motion=planner.FreeMotion())
ROUND_THE_WALL = planner.PlanningProblem(ARM, [LEFT_OF_WALL, RIGHT_OF_WALL], scene=planner.Scene([WALL], margin=0.01))
KUKA = load_robot("kuka_kr16_l6_2")
BESIDE, OPPOSITE = (planner.PoseWaypoint(planner.Pose.from_rpy([1.2, y, 0.7], [0.0, np.pi, 0.0])) for y in (-0.6, 0.6))
TABLE = planner.SceneObject("table", [planner.Box([1.0, 2.0, 0.05])], planner.Pose([1.3, 0.0, 0.3]))
PERSON = planner.SceneObject("person", [planner.Sphere(0.2)], planner.Pose([1.85, 0.0, 0.7]))
LIFT = planner.RelativeWaypoint(planner.CartesianMove((0.02, -0.03, 0.05)))
PROBLEMS = {
    "beside a table": planner.PlanningProblem(KUKA, [BESIDE, OPPOSITE], scene=planner.Scene([TABLE], margin=0.05)),
    "past a person": planner.PlanningProblem(
        KUKA,
        [BESIDE, OPPOSITE],
        scene=planner.Scene([PERSON]),
        speed_zones=[planner.SpeedZone(0.45, 0.25, ["person"])],
    ),
    "round a wall": ROUND_THE_WALL,
    "blend beside a ball": along_a_rectangle(ball_at(*BESIDE_A_LINE), planner.LinearMotion()),
    "from an open orientation": planner.PlanningProblem(
        KUKA,
        [
            planner.PoseWaypoint(planner.Pose([0.9, 0.3, 0.8])),
            LIFT,
            planner.JointWaypoint(KUKA.middle, motion=planner.FreeMotion()),
        ],
        self_collision=False,
    ),
}


@pytest.mark.long_table
@pytest.mark.parametrize("name", PROBLEMS)
def test_a_loaded_plan_has_what_the_planner_found(name: str) -> None:
    problem = PROBLEMS[name]
    made = planner.plan(problem)
    loaded = load_plan(save_plan(made), problem, made.backend, with_groups=True)
    assert every_bit(loaded) == every_bit(made)
    assert blend_radii(loaded.problem) == blend_radii(made.problem)
    assert list(loaded.problem.numbers) == list(made.problem.numbers)
    np.testing.assert_array_equal(loaded.path.positions, made.path.positions)
    errors = [[waypoint.position_error for waypoint in plan.path.waypoints] for plan in (loaded, made)]
    assert errors[0] == errors[1]
    for own, again in zip(made.path.groups, loaded.path.groups, strict=True):
        np.testing.assert_array_equal(again.curve.coefficients, own.curve.coefficients)


def test_the_gain_of_a_better_detour_is_saved() -> None:
    motion = planner.FreeMotion(optimise="duration", optimise_checks=1)
    problem = replace(ROUND_THE_WALL, waypoints=[LEFT_OF_WALL, planner.JointWaypoint(RIGHT, motion=motion)])
    made = planner.plan(problem, planner.Toppra())
    (way,) = load_plan(save_plan(made), problem, made.backend).detours
    assert way.gain == made.detours[0].gain is not None
