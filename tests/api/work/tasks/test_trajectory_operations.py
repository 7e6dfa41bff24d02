"""The operations over HTTP on trajectories, given as a plan's own answer or as samples."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from api.contract.answers import PlanAnswer
from api.contract.trajectory_operations import JoinAnswer, OperationAnswer, RetimeAnswer
from tests.api.answers import checked
from tests.api.requests import joint
from tests.locations import ROOT

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

OPERATIONS = ROOT / "examples" / "operations"
ANSWERS = {"join": JoinAnswer, "retime": RetimeAnswer}
ROBOT = {"robot": "kuka_kr16_l6_2"}


@pytest.fixture(scope="module")
def plan(service: RunningService) -> dict[str, Any]:
    waypoints = [joint(0.3, -1.2, 1.4, 0.2, 0.6, 0.1), joint(0.9, -1.6, 1.1, -0.4, 0.2, 0.5)]
    request = ROBOT | {"waypoints": waypoints, "backend": {"kind": "ruckig"}, "include": ["polynomials"]}
    return checked(service.post("/v1/trajectories", request), PlanAnswer)


def post(service: RunningService, name: str, body: dict[str, Any]) -> dict[str, Any]:
    return checked(service.post(f"/v1/trajectories/{name}", ROBOT | body), ANSWERS.get(name, OperationAnswer))


def given(plan: dict[str, Any]) -> dict[str, Any]:
    return {"trajectory": {"polynomials": plan["polynomials"]}}


@pytest.mark.parametrize("file", sorted(OPERATIONS.glob("*.json")), ids=lambda file: file.stem)
def test_examples_are_answered(service: RunningService, file: Any) -> None:
    answer = post(service, file.stem.partition("_")[0], json.loads(file.read_text()))
    assert answer["certificate"]["satisfied"]
    assert answer["samples"]["time"][-1] == answer["duration"]


def test_a_plan_is_cut_and_joined_and_is_the_plan(service: RunningService, plan: dict[str, Any]) -> None:
    middle = 0.4 * plan["duration"]
    first, last = (
        post(service, "slice", given(plan) | part | {"include": ["polynomials"]})
        for part in ({"end": middle}, {"start": middle})
    )
    assert [warning["code"] for warning in first["warnings"]] == ["ends_in_motion"]
    assert [warning["code"] for warning in last["warnings"]] == ["starts_in_motion"]
    assert first["final"]["velocity"] == pytest.approx(last["initial"]["velocity"], abs=1e-9)
    trajectories = [{"polynomials": part["polynomials"]} for part in (first, last)]
    whole = post(service, "join", {"trajectories": trajectories})
    assert np.array(whole["samples"]["position"]) == pytest.approx(np.array(plan["samples"]["position"]), abs=1e-9)
    assert whole["certificate"]["continuity"] == plan["certificate"]["continuity"]
    assert whole["junctions"][0]["time"] == pytest.approx(middle)


def test_the_way_back_and_its_samples_at_other_times(service: RunningService, plan: dict[str, Any]) -> None:
    back = post(service, "reverse", given(plan) | {"include": ["polynomials", "torque"], "payload": {"mass": 2.0}})
    assert back["initial"]["position"] == pytest.approx(plan["samples"]["position"][-1])
    assert "torque" in back["samples"]
    times = [0.1, 0.2, 0.35]
    again = post(service, "resample", given(back) | {"times": times, "include": ["jerk"]})
    assert again["samples"]["time"] == times
    there = post(service, "resample", given(plan) | {"times": sorted(plan["duration"] - t for t in times)})
    for name, sign in (("position", 1.0), ("velocity", -1.0), ("acceleration", 1.0)):
        rows, turned = np.array(again["samples"][name]), np.array(there["samples"][name])[::-1]
        assert rows == pytest.approx(sign * turned, abs=1e-9)


def test_a_plan_is_stopped_and_so_is_a_state(service: RunningService, plan: dict[str, Any]) -> None:
    middle = 0.4 * plan["duration"]
    at_middle = post(service, "resample", given(plan) | {"times": [middle]})["samples"]
    state = {name: at_middle[name][0] for name in ("position", "velocity", "acceleration")}
    by_joints = post(service, "stop", given(plan) | {"time": middle, "mode": "joints"})
    assert post(service, "stop", {"state": state})["duration"] == pytest.approx(by_joints["duration"])
    on_path = post(service, "stop", given(plan) | {"time": middle})
    for stop in (by_joints, on_path):
        assert stop["initial"]["velocity"] == pytest.approx(state["velocity"], abs=1e-9)
        assert stop["final"]["velocity"] == pytest.approx([0.0] * 6, abs=1e-6)
    state["position"][0] = 3.2
    state["velocity"][0] = 2.0
    problem = service.post("/v1/trajectories/stop", ROBOT | {"state": state}).json()
    assert (problem["code"], problem["joint"]) == ("joint_position_limit", "joint_a1")


def test_a_plan_is_timed_again(service: RunningService, plan: dict[str, Any]) -> None:
    for trajectory in given(plan)["trajectory"], {"samples": {k: plan["samples"][k] for k in ("time", "position")}}:
        again = post(service, "retime", {"trajectory": trajectory, "backend": {"kind": "ruckig"}})
        assert again["deviation"] <= 1e-3
        assert again["duration"] == pytest.approx(plan["duration"], rel=0.03)
        assert again["final"]["position"] == pytest.approx(plan["samples"]["position"][-1])


@pytest.mark.parametrize("name", ["reverse", "slice", "resample", "retime"])
def test_a_payload_above_the_rating_is_refused(service: RunningService, plan: dict[str, Any], name: str) -> None:
    assert post(service, name, given(plan) | {"payload": {"mass": 6.0}})["certificate"]["satisfied"]
    problem = service.post(f"/v1/trajectories/{name}", ROBOT | given(plan) | {"payload": {"mass": 7.0}}).json()
    assert (problem["code"], problem["value"], problem["limit"]) == ("payload_exceeded", 7.0, 6.0)


@pytest.mark.parametrize("mode", ["on_path", "joints"])
def test_a_stop_warns_of_a_payload_above_the_rating(service: RunningService, plan: dict[str, Any], mode: str) -> None:
    own = {"time": 0.4 * plan["duration"], "mode": mode}
    for mass, warned in ((6.0, False), (7.0, True)):
        answer = post(service, "stop", given(plan) | own | {"payload": {"mass": mass}})
        assert answer["certificate"]["satisfied"]
        assert ("payload_above_rating" in [warning["code"] for warning in answer["warnings"]]) == warned


def test_samples_are_run_by_the_interpolation_that_is_named(service: RunningService) -> None:
    samples = {"time": [0.0, 1.0], "position": [[0.0] * 6, [0.1] * 6], "velocity": [[0.0] * 6] * 2}
    for law, middle in (("linear", 0.025), ("cubic", 0.1 * (3 / 16 - 2 / 64))):
        trajectory = {"samples": samples, "interpolation": law}
        found = post(service, "resample", {"trajectory": trajectory, "times": [0.25]})
        assert found["samples"]["position"] == [pytest.approx([middle] * 6)]


def test_what_is_wrong_is_said_where_it_is(service: RunningService, plan: dict[str, Any]) -> None:
    polynomials = {"polynomials": plan["polynomials"]}
    twice = {"polynomials": plan["polynomials"][:5]}
    standing = {"time": [0, 0], "position": [[0] * 6] * 2}
    for name, body, pointer in (
        ("join", {"trajectories": [polynomials, polynomials]}, "/trajectories/1"),
        ("join", {"trajectories": [polynomials, twice]}, "/trajectories/1/polynomials"),
        ("slice", {"trajectory": polynomials, "start": 99.0}, "/start"),
        ("reverse", {"trajectory": {"samples": standing}}, "/trajectory/samples/time/1"),
        ("reverse", {"trajectory": {}}, "/trajectory/polynomials"),
        ("resample", {"trajectory": polynomials, "times": [0.2, 0.1]}, "/times/1"),
        ("retime", {}, "/points"),
        ("retime", {"points": [[0] * 6, [0] * 5]}, "/points/1"),
        ("retime", {"points": [[0] * 6], "backend": {"kind": "min_effort"}}, "/backend/kind"),
        ("stop", {}, "/state"),
        ("stop", {"trajectory": polynomials}, "/time"),
        ("stop", {"trajectory": polynomials, "time": 99.0}, "/time"),
        ("stop", {"trajectory": polynomials, "time": 99.0, "mode": "joints"}, "/time"),
        ("stop", {"state": {"position": [0] * 6, "velocity": [0] * 5}}, "/state/velocity"),
        ("stop", {"state": {"position": [0] * 6, "velocity": [0] * 6}, "mode": "on_path"}, "/trajectory"),
        ("resample", {"trajectory": polynomials, "times": [0.2], "period": 0.1}, "/period"),
        ("resample", {"trajectory": polynomials, "times": [0.2], "include": ["sample_checks"]}, "/times"),
        ("resample", {"trajectory": polynomials, "period": 1e-6}, "/period"),
    ):
        problem = service.post(f"/v1/trajectories/{name}", ROBOT | body).json()
        assert problem["code"] == "invalid_request", problem
        assert [fault["pointer"] for fault in problem["errors"]] == [pointer]
    narrow = {"limits": {"velocity_scale": 0.5}}
    problem = service.post("/v1/trajectories/reverse", ROBOT | given(plan) | narrow).json()
    assert (problem["code"], problem["limit"] < problem["value"]) == ("limits_unsatisfiable", True)
    assert problem["joint"].startswith("joint_a")


SWING = {"time": [0.0, 2.0], "position": [[-0.6, -0.9, 1.2, 0.0, 0.8, 0.0], [0.6, -0.9, 1.2, 0.0, 0.8, 0.0]]}
SWING |= {"velocity": [[0.0] * 6, [0.0] * 6], "acceleration": [[0.0] * 6, [0.0] * 6]}
"""Samples of a swing of the first joint."""


def test_operations_keep_clear_of_a_scene_or_are_refused(service: RunningService) -> None:
    """A wall on the way of the swing: what stops before it, or is cut off before it, keeps clear."""
    wall = {"id": "wall", "shape": {"kind": "box", "size": [2.0, 0.05, 2.0]}, "pose": {"position": [1.2, -0.6, 0.0]}}
    scene = {"scene": {"objects": [wall]}, "self_collision": False}
    swing = {"trajectory": {"samples": SWING}}
    there_and_back = [{"samples": SWING}, {"samples": SWING | {"position": SWING["position"][::-1]}}]
    whole: dict[str, Any] = {
        "reverse": swing,
        "resample": swing,
        "join": {"trajectories": there_and_back},
        "retime": {"points": SWING["position"], "backend": {"kind": "toppra"}},
    }
    far_away = scene | {"scene": {"objects": [wall | {"pose": {"position": [9.0, 9.0, 9.0]}}]}}
    for name, body in whole.items():
        free = post(service, name, body | far_away)
        assert free["certificate"]["clearance"]["scene"]["lower"] > 1.0
        assert "clearance" not in post(service, name, body)["certificate"]
        refused = service.post(f"/v1/trajectories/{name}", ROBOT | body | scene).json()
        assert refused["code"] in ("collision", "start_in_collision") and "wall" in refused["pair"], name
    behind = post(service, "slice", swing | scene | {"end": 0.5})
    assert behind["certificate"]["clearance"]["scene"]["pair"][1] == "wall"
    assert service.post("/v1/trajectories/slice", ROBOT | swing | scene).json()["code"] == "collision"


def test_a_stop_off_the_path_is_held_against_the_scene(service: RunningService) -> None:
    """A stop off the path may reach an obstacle: a pole stands at its end."""
    velocity = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    body = {"state": {"position": SWING["position"][0], "velocity": velocity}, "self_collision": False}
    free = post(service, "stop", body)
    end = post_poses(service, [free["final"]["position"]])[0]
    pole = {"id": "pole", "shape": {"kind": "sphere", "radius": 0.02}, "pose": {"position": end}}
    hit = service.post("/v1/trajectories/stop", ROBOT | body | {"scene": {"objects": [pole]}}).json()
    assert (hit["code"], hit["pair"][1]) == ("collision", "pole")
    away = pole | {"pose": {"position": [end[0], end[1], end[2] + 1.0]}}
    assert (
        post(service, "stop", body | {"scene": {"objects": [away]}})["certificate"]["clearance"]["scene"]["lower"] > 0.0
    )


def post_poses(service: RunningService, positions: list[list[float]]) -> list[list[float]]:
    poses = service.post("/v1/kinematics/forward", ROBOT | {"positions": positions}).json()["poses"]
    return [pose["position"] for pose in poses]
