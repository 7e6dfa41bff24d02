"""Residual vibration over HTTP: plans that suppress or report it, and trajectories of other origins."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from api.contract import answers, trajectory_operations
from api.contract.parts.common import VibrationMode
from planner.problems.waypoint_faults import MODE_RANGES
from tests.api.answers import checked
from tests.locations import ROOT

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

STILL: dict[str, Any] = json.loads((ROOT / "examples" / "still_after_each_motion.json").read_text(encoding="utf-8"))
MODE = STILL["residual_vibration"]
REPORTED = STILL | {"residual_vibration": MODE | {"suppress": False}, "include": ["polynomials"]}
PERIOD = 0.125025
"""The damped period of the mode, s."""


def vibration_of(certificate: dict[str, Any]) -> dict[str, Any]:
    (check,) = (check for check in certificate["checks"] if check["quantity"] == "residual_vibration")
    return dict(check)


def test_suppression_takes_a_period_a_motion_and_leaves_a_twentieth(service: RunningService) -> None:
    before = checked(service.post("/v1/trajectories", REPORTED), answers.PlanAnswer)
    after = checked(service.post("/v1/trajectories", STILL), answers.PlanAnswer)
    assert after["duration"] == pytest.approx(before["duration"] + 2 * PERIOD, abs=1e-6)
    reported, kept = (vibration_of(answer["certificate"]) for answer in (before, after))
    assert (reported["limit"], reported["enforced"]) == (None, False)
    assert kept["limit"] == pytest.approx(0.05 * reported["lower"], rel=1e-2)
    assert kept["peak"] <= kept["limit"]


def test_a_trajectory_of_any_origin_is_reported(service: RunningService) -> None:
    ends = [{name: value for name, value in own.items() if name != "dwell"} for own in STILL["waypoints"][:2]]
    planned = checked(service.post("/v1/trajectories", REPORTED | {"waypoints": ends}), answers.PlanAnswer)
    body = {"robot": "ur5e", "residual_vibration": MODE}
    rows = {name: planned["samples"][name] for name in ("time", "position")}
    peaks = []
    for given in ({"polynomials": planned["polynomials"]}, {"samples": rows}):
        answer = service.post("/v1/trajectories/validate", body | given)
        peaks.append(vibration_of(checked(answer, trajectory_operations.ValidationAnswer))["peak"])
    expected = vibration_of(planned["certificate"])["peak"]
    assert peaks[0] == pytest.approx(expected, rel=1e-9)
    # Straight lines between samples 0.01 s apart jump in velocity, which the amplitude includes.
    assert peaks[1] == pytest.approx(expected, rel=0.05)


def test_a_refusal_points_to_the_fields_and_its_remedy_can_be_sent(service: RunningService) -> None:
    passed = [*STILL["waypoints"]]
    passed[1] = {"kind": "joint", "position": passed[1]["position"], "transition": {"kind": "through"}}
    answer = service.post("/v1/trajectories", STILL | {"waypoints": passed})
    assert answer.status_code == 422
    problem = answer.json()
    assert problem["errors"][0]["pointer"] == "/waypoints/1/transition"
    (remedy,) = problem["remedies"]
    assert (remedy["change"], remedy["value"]) == ("/residual_vibration/suppress", False)
    sent = STILL | {"waypoints": passed, "residual_vibration": MODE | {"suppress": remedy["value"]}}
    made = checked(service.post("/v1/trajectories", sent), answers.PlanAnswer)
    assert vibration_of(made["certificate"])["limit"] is None


def test_programs_whose_controller_computes_the_time_scaling_are_refused(service: RunningService) -> None:
    for form, status in (("urscript_moves", 422), ("urscript", 200)):
        answer = service.post(f"/v1/trajectories?format={form}", STILL)
        assert answer.status_code == status, answer.text
        assert status == 200 or answer.json()["code"] == "unsupported_format"
    assert service.post("/v1/trajectories?format=urscript_moves", REPORTED | {"include": []}).status_code == 200


@pytest.mark.parametrize("field", MODE_RANGES)
def test_the_schema_has_the_ranges_of_the_library(field: str) -> None:
    schema = VibrationMode.model_json_schema()["properties"][field]
    assert (schema["minimum"], schema["maximum"]) == MODE_RANGES[field]
