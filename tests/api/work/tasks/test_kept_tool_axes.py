"""Free motions that keep an axis of the tool near a direction, over HTTP."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import planner
from tests.api.conftest import RunningService
from tests.locations import ROOT


def _request(**kept: Any) -> dict[str, Any]:
    request: dict[str, Any] = json.loads((ROOT / "examples/upright_cup.json").read_text())
    request["waypoints"][1]["motion"]["keep"][0] |= kept
    return request


def _angles(answer: dict[str, Any]) -> np.ndarray:
    robot = planner.load_robot("ur5e")
    rotations = [planner.tool_pose(robot, position).rotation for position in answer["samples"]["position"]]
    return np.arccos(np.clip([-rotation[2, 2] for rotation in rotations if rotation is not None], -1.0, 1.0))


def test_a_cup_stays_upright_where_it_would_tip_over(service: RunningService) -> None:
    request = _request() | {"sample_period": 0.001}
    answer = service.post("/v1/trajectories", request).raise_for_status().json()
    (check,) = [each for each in answer["certificate"]["checks"] if each["quantity"] == "tool_axis_angle"]
    assert check["method"] == "bounded"
    assert check["lower"] <= _angles(answer).max() + 1e-6 <= check["peak"] + 1e-6 <= 0.2 + 2e-6
    del request["waypoints"][1]["motion"]["keep"]
    free = service.post("/v1/trajectories", request).raise_for_status().json()
    assert _angles(free).max() > 1.0


@pytest.mark.parametrize(
    ("kept", "status", "pointer"),
    [
        ({"angle": 0.01}, 422, "/waypoints/1/motion/keep/0/angle"),
        ({"angle": 4.0}, 422, "/waypoints/1/motion/keep/0/angle"),
        ({"direction": [0.0, 0.0, 0.0]}, 422, "/waypoints/1/motion/keep/0/direction"),
        ({"direction": [0.0, 1.0]}, 422, "/waypoints/1/motion/keep/0/direction"),
        ({"axis": [0.0, 0.0, 0.0]}, 422, "/waypoints/1/motion/keep/0/axis"),
        ({"kind": "cup"}, 422, "/waypoints/1/motion/keep/0"),
        ({"direction": [0.0, 0.0, 1.0]}, 422, "/waypoints/0"),
    ],
)
def test_what_cannot_be_kept_is_refused_at_its_field(
    service: RunningService, kept: dict[str, Any], status: int, pointer: str
) -> None:
    refused = service.post("/v1/trajectories", _request(**kept))
    assert refused.status_code == status, refused.text
    assert any(fault["pointer"].startswith(pointer) for fault in refused.json()["errors"])
