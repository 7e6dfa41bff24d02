"""POST /v1/tasks/order: the answer, its request as a plan, and faults with pointers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from api.contract.answers import PlanAnswer
from api.contract.tasks import OrderAnswer
from tests.api.answers import checked

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

HOME = {"kind": "named", "name": "home"}
DOWN = {"kind": "rpy", "rpy": [3.141592653589793, 0.0, 0.0]}
LINE = {"kind": "linear"}
TABLE = {"id": "table", "shape": {"kind": "box", "size": [0.6, 1.2, 0.05]}, "pose": {"position": [0.6, 0.0, 0.0]}}


def pose(x: float, y: float, **fields: Any) -> dict[str, Any]:
    return {"kind": "pose", "pose": {"position": [x, y, 0.2], "orientation": DOWN}, **fields}


def order_request(*tasks: dict[str, Any], **fields: Any) -> dict[str, Any]:
    return {"robot": "ur5e", "start": HOME, "tasks": list(tasks), "backend": {"kind": "trapezoidal"}, **fields}


WAIT = {"kind": "wait", "duration": 1.0}
OUTPUT = {"kind": "set_output", "name": "gripper", "value": True}


def point(x: float, y: float, **fields: Any) -> dict[str, Any]:
    return {"waypoints": [pose(x, y)], **fields}


KINDS = [
    point(0.4, 0.3, name="hole"),
    {"waypoints": [pose(0.4, -0.3, free="rotation_z", dwell=0.5)], "after": ["hole"]},
    {
        "name": "seam",
        "reversible": True,
        "waypoints": [
            pose(0.5, -0.1),
            pose(0.5, 0.1, motion={"kind": "polyline", "poses": [pose(0.52, -0.05)["pose"]], "blend": 0.01}),
        ],
    },
    {"closed": True, "waypoints": [pose(x, y, motion=LINE) for x, y in ((0.3, 0.1), (0.4, 0.1), (0.4, 0.2))]},
    {"waypoints": [pose(0.45, 0.0, payload={"mass": 0.5}), pose(0.3, -0.2, put_down=True)], "group": "pairs"},
    point(0.3, -0.3, group="pairs"),
]
"""A hole, a hole with any turn after it, a seam, a contour, and a pick with its place in a group with a point."""


def test_actions_of_tasks_are_in_the_plan_and_in_its_request(service: RunningService) -> None:
    tasks = [{"waypoints": [pose(x, y, actions=[OUTPUT, WAIT])]} for x, y in ((0.4, 0.2), (0.4, -0.2))]
    request = order_request(*tasks, start=HOME | {"actions": [OUTPUT]})
    answer = checked(service.post("/v1/tasks/order", request), OrderAnswer)
    assert [action["kind"] for action in answer["plan"]["actions"]] == ["set_output", *["set_output", "wait"] * 2]
    plan = checked(service.post("/v1/trajectories", answer["request"]), PlanAnswer)
    assert plan["actions"] == answer["plan"]["actions"]
    assert plan["duration"] == answer["plan"]["duration"]


@pytest.mark.long_table
@pytest.mark.parametrize("fields", [{}, {"end": HOME}, {"scene": {"objects": [TABLE]}, "end": HOME}])
def test_request_of_the_answer_gives_the_same_plan(service: RunningService, fields: dict[str, Any]) -> None:
    answer = checked(service.post("/v1/tasks/order", order_request(*KINDS, **fields)), OrderAnswer)
    assert sorted(task["task"] for task in answer["order"]) == list(range(6))
    places = {task["task"]: k for k, task in enumerate(answer["order"])}
    assert places[0] < places[1]
    assert abs(places[4] - places[5]) == 1
    assert answer["bound"] <= answer["plan"]["duration"]
    assert answer["gap"] == pytest.approx(1.0 - answer["bound"] / answer["plan"]["duration"])
    plan = checked(service.post("/v1/trajectories", answer["request"]), PlanAnswer)
    assert plan["duration"] == pytest.approx(answer["plan"]["duration"], rel=1e-9)
    assert plan["request_hash"] == answer["plan"]["request_hash"]
    assert plan["waypoints"][0]["name"] == "home"


def test_request_of_an_answer_with_goal_sets_gives_the_same_plan(service: RunningService) -> None:
    far = {"kind": "joint", "position": [-2.0, -2.5, 0.5, 0.0, 0.0, 0.0]}
    grasps = {"kind": "any_of", "actions": [OUTPUT, WAIT], "options": [far, pose(0.4, 0.3)]}
    approach = {"kind": "sequence", "waypoints": [pose(0.4, -0.25), pose(0.4, -0.3, motion=LINE, dwell=0.5)]}
    elsewhere = far | {"position": [2.5, -0.5, -1.5, 1.0, 1.0, 3.0]}
    pick = {"waypoints": [grasps, {"kind": "any_of", "options": [approach, elsewhere]}]}
    request = order_request(pick, point(0.5, 0.0), end=HOME)
    answer = checked(service.post("/v1/tasks/order", request), OrderAnswer)
    assert {task["task"]: task["options"] for task in answer["order"]} == {0: [1, 0], 1: []}
    assert [action["kind"] for action in answer["plan"]["actions"]] == ["set_output", "wait"]
    plan = checked(service.post("/v1/trajectories", answer["request"]), PlanAnswer)
    assert plan["duration"] == pytest.approx(answer["plan"]["duration"], rel=1e-9)
    assert plan["request_hash"] == answer["plan"]["request_hash"]
    pick["waypoints"][1]["options"][1] = {**far, "latest_arrival": 1.0}
    pointers = [fault["pointer"] for fault in service.post("/v1/tasks/order", request).json()["errors"]]
    assert pointers == ["/tasks/0/waypoints/1/options/1/latest_arrival"]


DRILL = {
    "name": "drill",
    "tool": {"position": [0.0, 0.0, 0.15]},
    "take": [
        {"kind": "joint", "position": [2.5, -1.5, 1.9, -1.97, -1.57, 0.0], "dwell": 1.0, "payload": {"mass": 1.0}},
        {
            "kind": "relative",
            "frame": "tool",
            "move": {"kind": "cartesian", "translation": [0, 0, -0.05]},
            "motion": LINE,
        },
    ],
    "put_back": [
        {"kind": "joint", "position": [2.5, -1.5, 1.9, -1.97, -1.57, 0.0], "put_down": True, "actions": [OUTPUT]}
    ],
}
"""A drill in its holder."""


def test_request_of_an_answer_with_tools_gives_the_same_plan(service: RunningService) -> None:
    tasks = [point(0.4, 0.3, tool="drill"), point(0.4, 0.0), point(0.4, -0.3, tool="drill", name="hole")]
    request = order_request(*tasks, end=HOME, tools=[DRILL], tool={"position": [0.0, 0.0, 0.05]})
    answer = checked(service.post("/v1/tasks/order", request), OrderAnswer)
    assert [task["tool"] for task in answer["order"]] in ([None, "drill", "drill"], ["drill", "drill", None])
    planned = answer["request"]["waypoints"]
    heights = [waypoint["tool"]["position"][2] for waypoint in planned if waypoint.get("tool")]
    assert heights == pytest.approx([0.15, 0.05])
    assert [waypoint["payload"] for waypoint in planned if waypoint.get("payload")] == [{"mass": 1.0}]
    assert [action["kind"] for action in answer["plan"]["actions"]] == ["set_output"]
    plan = checked(service.post("/v1/trajectories", answer["request"]), PlanAnswer)
    assert plan["duration"] == pytest.approx(answer["plan"]["duration"], rel=1e-9)
    assert plan["request_hash"] == answer["plan"]["request_hash"]


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"tasks": []}, "/tasks"),
        (
            {"tasks": [{"closed": True, "waypoints": [pose(0.4, 0.0, actions=[WAIT]), pose(0.4, 0.1)]}]},
            "/tasks/0/closed",
        ),
        ({"start": {"kind": "joint", "position": [0.0]}}, "/start/position"),
        ({"end": {"kind": "named", "name": "nowhere"}}, "/end/name"),
        ({"tasks": [point(0.4, 0.0), {"waypoints": [HOME | {"name": "nowhere"}]}]}, "/tasks/1/waypoints/0/name"),
        ({"tasks": [point(0.4, 0.0, after=["hole"])]}, "/tasks/0/after/0"),
        ({"tasks": [point(0.4, 0.0, closed=True)]}, "/tasks/0/closed"),
        ({"tasks": [{"waypoints": [pose(0.4, 0.0, frame="part")]}]}, "/tasks/0/waypoints/0/frame"),
        (
            {"tasks": [{"reversible": True, "waypoints": [pose(0.4, 0.0), pose(0.4, 0.1, frame="world")]}]},
            "/tasks/0/waypoints/1/frame",
        ),
        ({"travel": {"kind": "free", "optimise": "duration", "time_budget": 1.0}}, "/travel/time_budget"),
        ({"tasks": [{"waypoints": [pose(0.4, 0.0)] * 100} for _ in range(11)]}, "/tasks"),
        ({"tasks": [point(0.4, 0.0, tool="saw")], "tools": [DRILL]}, "/tasks/0/tool"),
        ({"tools": [DRILL], "mounted": "saw"}, "/mounted"),
        ({"tools": [DRILL, DRILL]}, "/tools/1/name"),
        ({"tools": [DRILL | {"take": []}]}, "/tools/0/take"),
        ({"tools": [DRILL | {"take": [HOME | {"name": "nowhere"}]}]}, "/tools/0/take/0/name"),
        ({"tools": [DRILL | {"put_back": [pose(0.4, 0.0, motion=LINE)]}]}, "/tools/0/put_back/0/motion"),
        ({"tools": [DRILL | {"put_back": [HOME, pose(0.4, 0.0, tool=DRILL["tool"])]}]}, "/tools/0/put_back/1/tool"),
    ],
)
def test_fault_points_to_its_field(service: RunningService, change: dict[str, Any], pointer: str) -> None:
    problem = service.post("/v1/tasks/order", order_request(point(0.4, 0.0)) | change)
    assert problem.status_code == 422, problem.text
    assert pointer in [error["pointer"] for error in problem.json()["errors"]]


def test_unreachable_task_is_named(service: RunningService) -> None:
    problem = service.post("/v1/tasks/order", order_request(point(0.4, 0.0), point(3.0, 0.0, name="far")))
    assert problem.status_code == 422
    assert problem.json()["code"] == "unreachable_waypoint"
    assert "waypoint 0 of task 1 ('far')" in problem.json()["detail"]
