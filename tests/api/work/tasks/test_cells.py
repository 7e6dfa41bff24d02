"""POST /v1/cells/plan: the answer, added robots in a stored scene, and faults with pointers."""

from __future__ import annotations

import json
from copy import deepcopy
from itertools import combinations
from typing import TYPE_CHECKING, Any

import pytest
from typer.testing import CliRunner

from api.contract.answers import PlanAnswer
from api.contract.cells import MOST_ROBOTS, CellAnswer
from cli import app
from planner.cells.robots import MOST_ROBOTS as MOST_ROBOTS_OF_THE_LIBRARY
from tests.api.answers import checked
from tests.api.requests import dh_joint, dh_robot, joint
from tests.locations import ROOT

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.api.conftest import RunningService

CELLS = "/v1/cells/plan"
PART = {"id": "part", "shape": {"kind": "box", "size": [0.1, 0.1, 0.1]}, "pose": {"position": [0.0, 1.5, 3.0]}}
UPRIGHT = {"kind": "rpy", "rpy": [0.0, 0.0, 0.0]}


def member(name: str, y: float, **changes: Any) -> dict[str, Any]:
    """Return an arm of 2 m that moves in the plane above its base."""
    mounting = {"position": [0.0, y, 0.0], "orientation": UPRIGHT}
    waypoints = [joint(0.1, 0.2, 0.3), joint(0.4, 0.3, 0.2)]
    return {"name": name, "robot": "three_dof_arm", "mounting": mounting, "waypoints": waypoints, **changes}


def cell(**changes: Any) -> dict[str, Any]:
    return {"robots": [member("a", 0.0), member("b", 3.0)], "deadline": 60, **changes}


@pytest.mark.large_only
def test_each_trajectory_is_that_of_its_robot_with_the_waits_as_dwells(service: RunningService) -> None:
    request = json.loads((ROOT / "examples/cell/over_a_table.json").read_text()) | {"deadline": 60}
    answer = checked(service.post(CELLS, request), CellAnswer)
    assert [own["name"] for own in answer["robots"]] == ["left", "right"]
    assert [one["robots"] for one in answer["clearances"]] == [["left", "right"]]
    assert any(any(own["waits"]) for own in answer["robots"])
    assert answer["clearances"][0]["clearance"]["lower"] >= 0.02 - 1e-6
    assert answer["duration"] == max(own["plan"]["duration"] for own in answer["robots"])
    for own, planned in zip(request["robots"], answer["robots"], strict=True):
        alone = {name: value for name, value in own.items() if name != "name"} | {"scene": request["scene"]}
        for waypoint, wait in zip(own["waypoints"], planned["waits"], strict=True):
            waypoint["dwell"] = waypoint.get("dwell", 0.0) + wait
        plan = checked(service.post("/v1/trajectories", alone), PlanAnswer)
        assert plan["samples"] == planned["plan"]["samples"]
        assert planned["duration_alone"] == pytest.approx(plan["duration"] - sum(planned["waits"]))


@pytest.mark.large_only
def test_meetings_and_handovers_are_in_the_answer(service: RunningService) -> None:
    request = json.loads((ROOT / "examples/cell/handover.json").read_text()) | {"deadline": 60}
    answer = checked(service.post(CELLS, request), CellAnswer)
    (met,) = answer["meetings"]
    assert (met["name"], met["waypoints"]) == ("handover", {"left": 2, "right": 1})
    for own in answer["robots"]:
        there = own["plan"]["waypoints"][met["waypoints"][own["name"]]]
        assert there["name"] == "handover"
        assert there["arrival_time"] + 0.5 <= met["time"] + 1e-6
        assert there["departure_time"] >= met["time"] - 1e-6
    problem = service.post(CELLS, request | {"allowed_pairs": []}).json()
    assert problem["code"] == "collision"
    assert any("bar" in name for name in problem["pair"])


def test_command_line_writes_the_trajectories_of_the_answer(service: RunningService, tmp_path: Path) -> None:
    (tmp_path / "cell.json").write_text(json.dumps(cell(skew=0.01)))
    result = CliRunner().invoke(app, ["cell", str(tmp_path / "cell.json"), "-o", str(tmp_path)])
    assert result.exit_code == 0, result.stderr
    for own in service.post(CELLS, cell(skew=0.01)).json()["robots"]:
        written = json.loads((tmp_path / f"{own['name']}.json").read_text())
        assert {name: value for name, value in written.items() if name != "polynomials"} == own["plan"]


def test_added_robots_in_a_stored_scene_are_found(service: RunningService) -> None:
    arms = {"first_arm": dh_robot(id="first_arm"), "second_arm": dh_robot(id="second_arm", joints=[dh_joint(a=0.5)])}
    ends = {"first_arm": [[0.0, 0.0], [0.3, 0.2]], "second_arm": [[0.0], [0.4]]}
    stored = [f"/v1/robots/{name}" for name in arms] + ["/v1/scenes/one_cell"]
    try:
        for arm in arms.values():
            assert service.post("/v1/robots", arm).status_code == 201
        assert service.post("/v1/scenes", {"id": "one_cell", "objects": [PART]}).status_code == 201
        robots = [
            member(name, 3.0 * k, robot=name, waypoints=[joint(*at) for at in ends[name]])
            for k, name in enumerate(("second_arm", "first_arm"))
        ]
        answer = checked(service.post(CELLS, cell(robots=robots, scene="one_cell")), CellAnswer)
        assert [own["plan"]["robot"] for own in answer["robots"]] == ["second_arm", "first_arm"]
        assert [len(own["plan"]["joint_names"]) for own in answer["robots"]] == [1, 2]
        hashes = {own["plan"]["request_hash"] for own in answer["robots"]}
        assert len(hashes) == 1
    finally:
        for path in stored:
            service.client.delete(path)


def of_second(**changes: Any) -> Callable[[dict[str, Any]], Any]:
    """Return a change of the second robot."""
    return lambda request: request["robots"][1].update(changes)


def second_waypoint(**changes: Any) -> Callable[[dict[str, Any]], Any]:
    """Return a change of the second waypoint of the second robot."""
    return lambda request: request["robots"][1]["waypoints"][1].update(changes)


def hand_over(request: dict[str, Any]) -> None:
    request["scene"] = {"objects": [PART]}
    for own in request["robots"]:
        own["waypoints"][1]["attach"] = [{"id": "part"}]


def meet_in_another_order(request: dict[str, Any]) -> None:
    request["meetings"] = ["first", "second"]
    for own, names in zip(request["robots"], (("first", "second"), ("second", "first")), strict=True):
        for waypoint, name in zip(own["waypoints"], names, strict=True):
            waypoint["name"] = name


FAULTS: dict[str, Callable[[dict[str, Any]], Any]] = {
    "/robots": lambda request: request["robots"].pop(),
    "/robots/1/name": of_second(name="a"),
    "/robots/1/waypoints": of_second(waypoints=[]),
    "/robots/1/scene": of_second(scene={"objects": [PART]}),
    "/robots/1/repeat": of_second(repeat=2),
    "/robots/1/waypoints/1/position": second_waypoint(position=[0.1]),
    "/robots/1/waypoints/1/attach/0/id": hand_over,
    "/robots/1/attached/0/link": of_second(attached=[{"id": "x", "shape": PART["shape"], "link": "nothing"}]),
    "/robots/1/allowed_pairs/0": of_second(allowed_pairs=[["x", "y"]]),
    "/robots/1/sample_period": of_second(sample_period=1e-6),
    "/scene/attached": lambda request: request.update(scene={"attached": [{"id": "x", "shape": PART["shape"]}]}),
    "/scene/objects/0/frame": lambda request: request.update(scene={"objects": [PART | {"frame": "base"}]}),
    "/scene/objects/1/id": lambda request: request.update(scene={"objects": [PART, PART]}),
    "/frames/base": lambda request: request.update(frames={"base": {"position": [0.0, 0.0, 0.0]}}),
    "/meetings/0": lambda request: request.update(meetings=["nowhere"]),
    "/robots/1/waypoints/0/name": meet_in_another_order,
    "/allowed_pairs/0": lambda request: request.update(allowed_pairs=[["a/link_1", "link_1"]]),
    "/skew": lambda request: request.update(skew=-1.0),
    "/deadline": lambda request: request.update(deadline=1e6),
}


@pytest.mark.parametrize("pointer", FAULTS)
def test_fault_points_to_its_field(service: RunningService, pointer: str) -> None:
    request = deepcopy(cell())
    FAULTS[pointer](request)
    problem = service.post(CELLS, request)
    assert problem.status_code == 422, problem.text
    assert pointer in [error["pointer"] for error in problem.json()["errors"]]


def test_moving_objects_pass_the_robots_and_are_refused_where_they_meet_one(service: RunningService) -> None:
    passing = PART | {"motion": {"kind": "linear", "velocity": [0.5, 0.0, 0.0]}}
    answer = checked(service.post(CELLS, cell(scene={"objects": [passing]})), CellAnswer)
    assert [own["plan"]["certificate"]["clearance"]["scene"]["pair"][1] for own in answer["robots"]] == ["part"] * 2
    meeting = passing | {"pose": {"position": [0.24, 3.1, -0.05]}}  # where the second robot ends
    meeting["motion"] = {"kind": "linear", "velocity": [1e-3, 0.0, 0.0]}
    problem = service.post(CELLS, cell(scene={"objects": [meeting]})).json()
    assert (problem["code"], problem["robot"], problem["pair"][1]) == ("collision", 1, "part")
    skewed = service.post(CELLS, cell(scene={"objects": [passing]}, skew=0.1)).json()
    assert [error["pointer"] for error in skewed["errors"]] == ["/skew"]


def test_number_of_robots_is_that_of_the_library(service: RunningService) -> None:
    assert MOST_ROBOTS == MOST_ROBOTS_OF_THE_LIBRARY
    robots = [member(name, 3.0 * k) for k, name in enumerate("abcde")]
    assert service.post(CELLS, cell(robots=robots)).json()["errors"][0]["pointer"] == "/robots"
    answer = checked(service.post(CELLS, cell(robots=robots[:MOST_ROBOTS])), CellAnswer)
    assert [one["robots"] for one in answer["clearances"]] == [list(pair) for pair in combinations("abcd", 2)]


def test_a_refusal_of_one_robot_has_its_index(service: RunningService) -> None:
    unknown = cell(robots=[member("a", 0.0), member("b", 3.0, robot="nobody")])
    problem = service.post(CELLS, unknown).json()
    assert (problem["code"], problem["robot"]) == ("unknown_robot", 1)
    request = cell()
    request["robots"][1]["waypoints"][1]["duration"] = 0.001
    problem = service.post(CELLS, request).json()
    assert (problem["code"], problem["robot"], problem["segment"]) == ("infeasible_duration", 1, 0)
    assert problem["detail"].startswith("robot 'b': segment 0")
    (hint,) = problem["hints"]
    assert hint["change"] == "/robots/1/waypoints/1/duration"
    request["robots"][1]["waypoints"][1]["duration"] = hint["value"]
    checked(service.post(CELLS, request), CellAnswer)


def test_robots_that_touch_at_their_start_are_named(service: RunningService) -> None:
    problem = service.post(CELLS, cell(robots=[member("a", 0.0), member("b", 0.0)]))
    assert problem.json()["code"] == "start_in_collision"
    assert [name.partition("/")[0] for name in problem.json()["pair"]] == ["a", "b"]
    assert "robot" not in problem.json()
