"""Requests that once ended in an error of the service, in `tests/data/defects`."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from api.base.json_pointers import changed
from tests.locations import ROOT
from tests.robots_extra import need_robot

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

DEFECTS = ROOT / "tests" / "data" / "defects"


@pytest.mark.long_table
@pytest.mark.parametrize("kind", ["auto", "cubic", "ruckig", "toppra", "trapezoidal"])
@pytest.mark.parametrize("name", sorted(path.stem for path in DEFECTS.glob("*.json")))
def test_a_plan_or_a_reason(service: RunningService, name: str, kind: str) -> None:
    """Where durations that are left out help, they do."""
    body = json.loads((DEFECTS / f"{name}.json").read_text()) | {"backend": {"kind": kind}, "deadline": 60.0}
    need_robot(body["robot"])
    answer = service.post("/v1/trajectories", body)
    document = answer.json()
    assert answer.status_code in {200, 422}, document
    durations = [r for r in document.get("remedies", ()) if r["change"].endswith("/duration")]
    if document.get("code") == "infeasible_duration":
        assert durations
    for remedy in durations:
        body = changed(body, remedy["change"], remedy["value"])
    if durations:
        assert service.post("/v1/trajectories", body).status_code == 200


@pytest.mark.parametrize(
    "change",
    [
        {"limits": {"velocity": [1e-9, 1.0, 1.0]}},
        {"limits": {"acceleration": [1e-9, 1.0, 1.0], "acceleration_scale": 1e-9}},
        {"limits": {"tcp_linear_velocity": 1e-9}},
        {"limits": {"velocity_scale": 1e-9}},
        {"payload": {"mass": 1e-9}},
        {"payload": {"mass": 1.0, "inertia": [1e-320, 1e-320, 1e-320], "center_of_mass": [1e-320, 0.0, 0.0]}},
        {
            "waypoints": [
                {"kind": "joint", "position": [1e-320, 0.1, 0.2]},
                {"kind": "joint", "position": [0.0, 0.1, 0.2]},
            ]
        },
        {"waypoints": [{"kind": "joint", "position": [0.1, 0.1, 0.2]}] * 3},
        {"waypoints": [{"kind": "joint", "position": [0.1, 0.1, 0.2]}]},
    ],
)
@pytest.mark.parametrize("kind", ["auto", "cubic", "quintic", "ruckig", "toppra", "trapezoidal"])
def test_the_smallest_numbers_end_in_a_plan_or_a_reason(
    service: RunningService, kind: str, change: dict[str, Any]
) -> None:
    body = {
        "robot": "three_dof_arm",
        "waypoints": [{"kind": "joint", "position": [0.1, 0.2, 0.3]}, {"kind": "joint", "position": [0.3, 0.1, 0.5]}],
        "backend": {"kind": kind},
        "sample_period": 0.01,
        **change,
    }
    answer = service.post("/v1/trajectories", body)
    assert answer.status_code in {200, 422}, answer.text
    if "waypoints" in change:
        assert "waypoint_repeated" in {w["code"] for w in answer.json()["warnings"]} or len(change["waypoints"]) == 1
        assert answer.json()["samples"]["time"] == [0.0, 0.01]
