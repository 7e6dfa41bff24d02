"""`include: ["limits"]`: the limits in force on each segment of a plan, as page and reports draw them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from api.contract import answers
from tests.api.answers import checked
from tests.api.requests import joint

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

ROBOT = "kuka_kr16_2"
TORQUE = [[-3000.0, 2000.0], [-4000.0, 4100.0], [-1500.0, 1800.0], [-400.0, 410.0], [-500.0, 510.0], [-150.0, 160.0]]
OWN = {"velocity": [0.5, 2.0, 2.0, 2.0, 2.0, 2.0], "velocity_scale": 0.5, "tcp_linear_velocity": 0.4}
WHOLE = {
    "velocity": [1.0] * 6,
    "velocity_scale": 0.5,
    "acceleration_scale": 0.25,
    "torque_range": TORQUE,
    "tcp_linear_velocity": 0.9,
}
REQUEST = {
    "robot": ROBOT,
    "waypoints": [
        joint(0.0, -1.5, 1.5, 0.0, 0.5, 0.0),
        joint(0.2, -1.4, 1.4, 0.0, 0.5, 0.1) | {"limits": OWN},
        joint(0.4, -1.5, 1.5, 0.0, 0.5, 0.0),
    ],
    "limits": WHOLE,
    "backend": {"kind": "trapezoidal"},
    "include": ["limits"],
}


@pytest.fixture(scope="module")
def plan(service: RunningService) -> dict[str, Any]:
    return checked(service.post("/v1/trajectories", REQUEST), answers.PlanAnswer)


def test_limits_are_the_narrowest_of_robot_request_and_waypoint_times_all_scales(
    service: RunningService, plan: dict[str, Any]
) -> None:
    robot = service.client.get(f"/v1/robots/{ROBOT}").json()["joints"]
    limits = plan["limits"]
    scaled = {
        "velocity": [[0.5 * 0.25] + [0.25] * 5, [0.5] * 6],
        "acceleration": [[0.25 * own["acceleration"] for own in robot]] * 2,
        "jerk": [[own["jerk"] for own in robot]] * 2,
        "torque": [[upper for _, upper in TORQUE]] * 2,
    }
    for quantity, upper in scaled.items():
        assert limits[quantity]["upper"] == [pytest.approx(row) for row in upper], quantity
    assert limits["torque"]["lower"] == [[lower for lower, _ in TORQUE]] * 2
    assert limits["velocity"]["lower"] == [[-value for value in row] for row in limits["velocity"]["upper"]]
    for side in ("lower", "upper"):
        assert limits["position"][side] == [[own[side] for own in robot]] * 2


def test_limits_of_the_tool_are_one_value_a_segment(plan: dict[str, Any]) -> None:
    assert plan["limits"]["tool"] == {"tcp_linear_velocity": [0.4, 0.9]}


def test_a_joint_without_a_limit_has_null(service: RunningService) -> None:
    request = {
        "robot": "three_dof_arm",
        "waypoints": [joint(0.0, 0.2, 0.3), joint(0.1, 0.3, 0.2)],
        "include": ["limits"],
    }
    limits = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)["limits"]
    assert limits["position"] == {"lower": [[None] * 3], "upper": [[None] * 3]}
    assert limits["torque"]["upper"] == [[None] * 3]
    assert limits["tool"] == {}


def test_answers_hold_no_limits_unless_asked(service: RunningService) -> None:
    request = {name: value for name, value in REQUEST.items() if name != "include"}
    assert "limits" not in service.post("/v1/trajectories", request).json()
