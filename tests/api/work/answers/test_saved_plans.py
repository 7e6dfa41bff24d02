"""A saved plan is the plan, in every form and to the last bit."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

from api.contract.requests import PlanRequest
from api.work.answers.formats import FORMATS
from api.work.answers.plans import AnswerOptions
from api.work.answers.saved_plans import OF_THE_PATH, load_plan, save_plan
from api.work.conversion.problems import to_backend, to_planning_problem
from planner.planning import plan
from planner.robots import load_robot
from tests.api.requests import PARTS
from tests.locations import ROOT

CASES = {
    "blend_beside_a_post.json": {"include": sorted(OF_THE_PATH)},
    "blended_lines.json": {"include": list(PARTS), "limits": {"tcp_linear_velocity": 0.2}},
    "refuelling_case_1_poses.json": {},
    "named_configuration.json": {"backend": {"kind": "toppra", "jerk_limited": True}},
    "blended_lines.json by the package": {"backend": {"kind": "toppra", "solver": "package"}},
    "on_a_pallet.json": {"payload": {"mass": 1.0}, "include": ["torque"]},
}


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
