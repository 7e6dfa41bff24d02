"""Free motions that keep constraints on the tool, over HTTP."""

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


@pytest.mark.long_table
@pytest.mark.parametrize(
    ("kept", "quantity", "limit"),
    [
        (
            {"kind": "orientation", "orientation": {"kind": "rpy", "rpy": [0.0, 3.0, 3.5]}, "angle": 1.2},
            "tool_orientation_angle",
            1.2,
        ),
        (
            {"kind": "plane", "point": [0.0, 0.0, 0.35], "normal": [0.0, 0.0, 2.0], "distance": 0.25},
            "tool_plane_distance",
            0.25,
        ),
        (
            {"kind": "line", "point": [0.5, 0.0, 0.45], "direction": [0.0, 1.0, 0.0], "distance": 0.3},
            "tool_line_distance",
            0.3,
        ),
        ({"kind": "box", "pose": {"position": [0.5, 0.0, 0.4]}, "size": [0.5, 0.9, 0.7]}, "tool_beyond_box", 0.0),
        ({"kind": "half_space", "normal": [0.0, 0.0, 1.0], "offset": 0.75}, "tool_beyond_half_space", 0.0),
    ],
)
def test_every_kind_is_planned_and_checked(
    service: RunningService, kept: dict[str, Any], quantity: str, limit: float
) -> None:
    request = _request()
    request["waypoints"][1]["motion"]["keep"] = [kept]
    answer = service.post("/v1/trajectories", request).raise_for_status().json()
    (check,) = [each for each in answer["certificate"]["checks"] if each["quantity"] == quantity]
    assert check["limit"] == limit
    assert check["lower"] <= check["peak"] <= limit + 2e-6


@pytest.mark.parametrize(
    ("kept", "pointer"),
    [
        ({"kind": "plane", "point": [0.0, 0.0, 0.0], "normal": [0.0, 0.0, 0.0], "distance": 0.5}, "keep/0/normal"),
        ({"kind": "plane", "point": [0.0, 0.0, 0.0], "normal": [0.0, 0.0, 1.0], "distance": 0.0}, "keep/0/distance"),
        ({"kind": "line", "point": [0.0, 0.0], "direction": [0.0, 0.0, 1.0], "distance": 0.1}, "keep/0/point"),
        ({"kind": "box", "pose": {"position": [0.0, 0.0, 0.0]}, "size": [0.1, 0.1, 0.0]}, "keep/0/size/2"),
        ({"kind": "orientation", "orientation": None, "angle": 0.1}, "keep/0/orientation"),
        ({"kind": "half_space", "normal": [0.0, 0.0, 1.0], "offset": None}, "keep/0/offset"),
    ],
)
def test_invalid_fields_of_every_kind_are_refused_at_their_place(
    service: RunningService, kept: dict[str, Any], pointer: str
) -> None:
    request = _request()
    request["waypoints"][1]["motion"]["keep"] = [kept]
    refused = service.post("/v1/trajectories", request)
    assert refused.status_code == 422, refused.text
    assert any(f"/waypoints/1/motion/{pointer}" in fault["pointer"] for fault in refused.json()["errors"]), refused.text


def test_an_end_beyond_a_half_space_is_refused_with_its_value(service: RunningService) -> None:
    request = _request()
    request["waypoints"][1]["motion"]["keep"] = [{"kind": "half_space", "normal": [0.0, 0.0, 1.0], "offset": 0.35}]
    refused = service.post("/v1/trajectories", request)
    (fault,) = refused.json()["errors"]
    assert fault["pointer"] == "/waypoints/1"
    assert "got 0.05 m (tool beyond its half-space)" in fault["message"]
