"""Actions of a request: their times in the answer, their waits in the trajectory, and refusals."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from api.contract import answers
from tests.api.answers import checked
from tests.api.requests import joint, plan_request
from tests.locations import ROOT

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

PLAN = "/v1/trajectories"
THREE = [joint(0.1, 0.2, 0.3), joint(0.3, 0.1, 0.5, dwell=0.2), joint(0.1, 0.2, 0.3)]


def output(value: Any = True, **at: Any) -> dict[str, Any]:
    return {"kind": "set_output", "at": at, "name": "gripper", "value": value}


def wait(duration: float, **at: Any) -> dict[str, Any]:
    return {"kind": "wait", "at": at, "duration": duration}


def test_actions_are_timed_and_waits_lengthen_the_dwell(service: RunningService) -> None:
    actions = [wait(0.5, waypoint=1), output(waypoint=1), output(2.5, time=0.0)]
    request = plan_request(waypoints=THREE, actions=actions)
    plain = checked(service.post(PLAN, plan_request(waypoints=THREE)), answers.PlanAnswer)
    answer = checked(service.post(PLAN, request), answers.PlanAnswer)
    assert "actions" not in plain
    assert answer["duration"] == pytest.approx(plain["duration"] + 0.5)
    arrival = answer["waypoints"][1]["arrival_time"]
    assert [(one["index"], one["kind"], one["time"]) for one in answer["actions"]] == [
        (2, "set_output", 0.0),
        (0, "wait", arrival),
        (1, "set_output", pytest.approx(arrival + 0.5)),
    ]
    assert [one.get("value") for one in answer["actions"]] == [2.5, None, True]
    assert answer["actions"][1]["duration"] == 0.5


def test_a_distance_is_that_of_the_tools_way(service: RunningService) -> None:
    """By the chords between the poses of the answer, 1 ms apart."""
    request = plan_request(waypoints=THREE, actions=[output(distance=0.1)], include=["tcp_pose"], sample_period=0.001)
    answer = service.post(PLAN, request).json()
    places = np.array(answer["samples"]["tcp_pose"]["position"])
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    (action,) = answer["actions"]
    assert action["distance"] == pytest.approx(0.1, rel=1e-9)
    assert np.interp(action["time"], answer["samples"]["time"], gone) == pytest.approx(0.1, rel=1e-4)


@pytest.mark.parametrize(
    ("action", "pointer"),
    [
        (output(), "/actions/0/at"),
        (output(waypoint=1, time=0.1), "/actions/0/at"),
        (output(waypoint=3), "/actions/0/at/waypoint"),
        (output(time=1e3), "/actions/0/at/time"),
        (output(distance=1e3), "/actions/0/at/distance"),
        (output("on", waypoint=1), "/actions/0/value"),
        (wait(0.5, time=0.1), "/actions/0/at"),
        (wait(0.5, waypoint=7), "/actions/0/at/waypoint"),
        (wait(0.0, waypoint=1), "/actions/0/duration"),
        ({"kind": "shout", "at": {"time": 0.0}}, "/actions/0/kind"),
    ],
)
def test_what_cannot_be_is_refused_with_a_pointer(
    service: RunningService, action: dict[str, Any], pointer: str
) -> None:
    problem = service.post(PLAN, plan_request(waypoints=THREE, actions=[action])).json()
    assert problem["code"] == "invalid_request"
    assert problem["errors"][0]["pointer"].startswith(pointer)


def test_a_wait_where_the_robot_passes_is_refused(service: RunningService) -> None:
    passed = [THREE[0], joint(0.3, 0.1, 0.5, transition={"kind": "through"}), THREE[2]]
    problem = service.post(PLAN, plan_request(waypoints=passed, actions=[wait(0.5, waypoint=1)])).json()
    assert problem["errors"][0]["pointer"] == "/waypoints/1/dwell"


def test_a_program_sets_outputs_and_a_table_refuses(service: RunningService) -> None:
    request = json.loads((ROOT / "examples" / "gripper.json").read_text(encoding="utf-8"))
    program = service.post(f"{PLAN}/export?format=urscript", request).text
    assert program.index("set_standard_digital_out(0, True)") < program.index("set_standard_digital_out(1, True)")
    refused = service.post(f"{PLAN}?format=csv", request).json()
    assert refused["code"] == "unsupported_format"


def test_actions_of_a_waypoint_are_those_of_the_request_at_it(service: RunningService) -> None:
    """They follow the request's actions at the waypoint; a wait lengthens the dwell before the next action."""
    there = [{"kind": "wait", "duration": 0.5}, {"kind": "set_output", "name": "gripper", "value": True}]
    waypoints = [THREE[0], {**THREE[1], "actions": there}, THREE[2]]
    own = [output(False, waypoint=1)]
    answer = checked(service.post(PLAN, plan_request(waypoints=waypoints, actions=own)), answers.PlanAnswer)
    same = plan_request(waypoints=THREE, actions=[*own, wait(0.5, waypoint=1), output(waypoint=1)])
    expected = checked(service.post(PLAN, same), answers.PlanAnswer)
    assert answer["actions"] == expected["actions"]
    assert answer["samples"] == expected["samples"]
    assert [one["time"] - answer["waypoints"][1]["arrival_time"] for one in answer["actions"]] == pytest.approx(
        [0.0, 0.0, 0.5]
    )
    moving = {**THREE[1], "dwell": 0.0, "transition": {"kind": "through"}, "actions": there}
    refused = service.post(PLAN, plan_request(waypoints=[THREE[0], moving, THREE[2]]))
    assert (refused.status_code, refused.json()["errors"][0]["pointer"]) == (422, "/waypoints/1/dwell")
