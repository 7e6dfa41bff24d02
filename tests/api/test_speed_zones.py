"""Speed zones over HTTP: plans are slowed, other trajectories are held against them."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from api.schemas import answers
from tests.api.answers import checked
from tests.locations import ROOT

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

WALKWAY: dict[str, Any] = json.loads((ROOT / "examples" / "slow_beside_a_walkway.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def slow(service: RunningService) -> dict[str, Any]:
    answer = service.post("/v1/trajectories", WALKWAY | {"include": ["polynomials"]})
    return checked(answer, answers.PlanAnswer)


def test_a_plan_says_how_fast_it_is_in_each_zone(slow: dict[str, Any]) -> None:
    wide, narrow = slow["certificate"]["speed_zones"]
    for check, zone in zip((wide, narrow), WALKWAY["speed_zones"], strict=True):
        assert check["clearance"] == zone["clearance"]
        assert check["objects"] == ["walkway"]
        assert check["method"] == "certified"
        assert 0.95 * zone["speed"] < check["peak"] <= check["limit"] == zone["speed"]
    (outer,), (inner,) = wide["intervals"], narrow["intervals"]
    assert outer[0] <= inner[0] < inner[1] <= outer[1]
    assert inner[0] <= narrow["time"] <= inner[1]


def test_a_trajectory_of_another_origin_is_held_against_zones(service: RunningService, slow: dict[str, Any]) -> None:
    plain = {name: value for name, value in WALKWAY.items() if name != "speed_zones"} | {"include": ["polynomials"]}
    quick = checked(service.post("/v1/trajectories", plain), answers.PlanAnswer)
    assert quick["duration"] < slow["duration"]
    assert "speed_zones" not in quick["certificate"]
    asked = {name: WALKWAY[name] for name in ("robot", "scene", "speed_zones")}
    for planned, satisfied in ((slow, True), (quick, False)):
        body = asked | {"polynomials": planned["polynomials"]}
        answer = checked(service.post("/v1/trajectories/validate", body), answers.InterpolationCertificate)
        assert answer["satisfied"] is satisfied
        assert all(check["ratio"] <= 1.0 + 1e-9 for check in answer["speed_zones"]) is satisfied
        assert answer["collision"] is None


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"scene": None}, "/speed_zones"),
        ({"speed_zones": [{"clearance": 0.3, "speed": 0.25, "objects": ["nobody"]}]}, "/speed_zones/0/objects/0"),
        ({"speed_zones": [{"clearance": 0.3, "speed": 0.0}]}, "/speed_zones/0/speed"),
    ],
)
def test_zones_that_cannot_be_are_refused(service: RunningService, change: dict[str, Any], pointer: str) -> None:
    answer = service.post("/v1/trajectories", WALKWAY | change)
    assert answer.status_code == 422
    assert [error["pointer"] for error in answer.json()["errors"]] == [pointer]
