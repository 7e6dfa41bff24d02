"""Optimised durations over HTTP: the report in the answer, and refusals with pointers."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from api.contract import answers
from tests.api.answers import checked
from tests.locations import ROOT

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

ELBOW: dict[str, Any] = json.loads((ROOT / "examples" / "elbow_saves_time.json").read_text(encoding="utf-8"))
LINE = {"samples": {"time": [0.0, 1.0], "position": [[0.0] * 7] * 2}}
WITHOUT = {name: value for name, value in ELBOW.items() if not name.startswith("optimise")}


def test_the_answer_has_both_durations_and_the_moved_waypoints(service: RunningService) -> None:
    before = checked(service.post("/v1/trajectories", WITHOUT), answers.PlanAnswer)
    after = checked(service.post("/v1/trajectories", ELBOW), answers.PlanAnswer)
    report = after["optimisation"]
    assert before.get("optimisation") is None
    assert (report["first"], report["last"]) == (before["duration"], after["duration"])
    assert after["duration"] < 0.99 * before["duration"]
    assert (report["moved"], report["blends"]) == ([1], [])
    assert after["waypoints"][1]["position"] != before["waypoints"][1]["position"]
    assert after["waypoints"][1]["position_error"] < 1e-5


@pytest.mark.parametrize("part", ["samples", "polynomials"])
def test_one_iterate_from_an_earlier_answer_is_as_short_as_that(service: RunningService, part: str) -> None:
    earlier = checked(service.post("/v1/trajectories", ELBOW | {"include": ["polynomials"]}), answers.PlanAnswer)
    body = ELBOW | {"optimise_iterates": 1, "warm_start": {part: earlier[part]}}
    answer = checked(service.post("/v1/trajectories", body), answers.PlanAnswer)
    assert answer["duration"] <= earlier["duration"] * (1.0 + 1e-5)


@pytest.mark.large_only
def test_a_time_budget_ends_before_the_deadline(service: RunningService) -> None:
    """The budget is longer than the deadline, and the answer comes in time."""
    body = WITHOUT | {"optimise": "duration", "time_budget": 100.0, "deadline": 2.0}
    answer = checked(service.post("/v1/trajectories", body), answers.PlanAnswer)
    assert answer["optimisation"]["last"] <= answer["optimisation"]["first"]


def test_nothing_open_is_a_warning(service: RunningService) -> None:
    body = ELBOW | {"waypoints": [ELBOW["waypoints"][0], ELBOW["waypoints"][2]]}
    answer = checked(service.post("/v1/trajectories", body), answers.PlanAnswer)
    assert answer["optimisation"]["iterates"] == 0
    assert "nothing_to_optimise" in [warning["code"] for warning in answer["warnings"]]


@pytest.mark.parametrize(
    ("more", "pointer"),
    [
        ({"optimise": "effort"}, "/optimise"),
        ({"duration": 5.0}, "/optimise"),
        ({"optimise": None}, "/optimise_iterates"),
        ({"time_budget": 0.0}, "/time_budget"),
        ({"optimise": None, "optimise_iterates": None, "warm_start": LINE}, "/warm_start"),
        (
            {"warm_start": {"samples": LINE["samples"] | {"position": [[0.0] * 6] * 2}}},
            "/warm_start/samples/position/0",
        ),
        ({"warm_start": {}}, "/warm_start/polynomials"),
    ],
)
def test_contradictions_are_refused(service: RunningService, more: dict[str, Any], pointer: str) -> None:
    answer = service.post("/v1/trajectories", ELBOW | more)
    assert answer.status_code == 422
    assert pointer in [fault["pointer"] for fault in answer.json()["errors"]]
