"""POST /v1/trajectories/validate: interpolation of samples by a controller, and the same verdict in plans."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from api.contract import answers, trajectory_operations
from planner.backends import BACKENDS
from tests.api.answers import checked
from tests.api.requests import joint, plan_request, validate_request

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

VALIDATE = "/v1/trajectories/validate"


@pytest.mark.long_table
@pytest.mark.parametrize("kind", BACKENDS)
@pytest.mark.parametrize("sample_period", [0.01, 0.2])
def test_a_plan_says_what_its_samples_are_validated_as(
    service: RunningService, kind: str, sample_period: float
) -> None:
    """Defect 7 of issue 11: the service's own samples failed silently under another time scaling than the plan's."""
    waypoints = [joint(0.3, -1.2, 1.4, 0.2, 0.6, 0.1), joint(0.9, -1.6, 1.1, -0.4, 0.2, 0.5)]
    common = {"robot": "kuka_kr16_l6_2", "limits": {"velocity_scale": 0.5}}
    asked = {"waypoints": waypoints, "backend": {"kind": kind}, "sample_period": sample_period}
    request = common | asked | {"include": ["polynomials", "sample_checks"]}
    plan = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)
    samples = {name: plan["samples"][name] for name in ("time", "position", "velocity", "acceleration")}
    sent = common | {"samples": samples, "polynomials": plan["polynomials"]}
    assert [said["interpolation"] for said in plan["sample_checks"]] == ["linear", "cubic", "quintic"]
    for said in plan["sample_checks"]:
        validated = service.post(VALIDATE, sent | {"interpolation": said["interpolation"]})
        found = checked(validated, trajectory_operations.ValidationAnswer)
        assert (found["interpolation"], found["satisfied"]) == (said["interpolation"], said["satisfied"])
        assert found["continuity"] == said["continuity"]
        assert {check["quantity"]: check["ratio"] for check in found["checks"]} == {
            check["quantity"]: None if check["ratio"] is None else pytest.approx(check["ratio"], rel=1e-3)
            for check in said["checks"]
        }
    assert plan["sample_checks"][0]["satisfied"]
    assert service.post(VALIDATE, sent).json()["interpolation"] == "quintic", "by the columns, as ever"
    [exact] = [service.post(VALIDATE, sent | {"interpolation": "polynomials"}).json()]
    assert exact["satisfied"]
    alone = service.post(VALIDATE, common | {"polynomials": plan["polynomials"]}).json()
    assert alone == exact
    said_peaks = {check["quantity"]: check["peak"] for check in plan["certificate"]["checks"]}
    for check in exact["checks"]:
        assert check["peak"] == pytest.approx(said_peaks[check["quantity"]], rel=1e-3, abs=1e-9)


def test_a_plan_warns_of_samples_that_are_too_far_apart(service: RunningService) -> None:
    waypoints = [joint(0.3, -1.2, 1.4, 0.2, 0.6, 0.1), joint(0.9, -1.6, 1.1, -0.4, 0.2, 0.5)]
    request = {"robot": "kuka_kr16_l6_2", "waypoints": waypoints, "backend": {"kind": "ruckig"}}
    found = {}
    for period in (0.001, 0.3):
        plan = checked(service.post("/v1/trajectories", request | {"sample_period": period}), answers.PlanAnswer)
        found[period] = [warning["code"] for warning in plan["warnings"]]
    assert found == {0.001: [], 0.3: ["samples_overshoot"]}


def test_a_start_in_motion_validates_when_it_is_told(service: RunningService) -> None:
    motion = {"initial_velocity": [0.02, 0.0, 0.01], "final_velocity": [0.0, 0.01, 0.0]}
    request = plan_request(backend={"kind": "ruckig", **motion}, include=["polynomials"])
    polynomials = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)["polynomials"]
    sent = {"robot": request["robot"], "polynomials": polynomials}
    assert service.post(VALIDATE, sent | motion).json()["satisfied"]
    assert not service.post(VALIDATE, sent).json()["satisfied"]


def test_too_fast_a_trajectory_does_not_validate_and_that_is_no_error(service: RunningService) -> None:
    samples = {"time": [0.0, 1e-3], "position": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]}
    certificate = checked(
        service.post(VALIDATE, validate_request(samples=samples)), trajectory_operations.ValidationAnswer
    )
    assert certificate["satisfied"] is False
    [velocity] = [check for check in certificate["checks"] if check["quantity"] == "velocity"]
    assert velocity["peak"] == pytest.approx(1000.0)
    assert velocity["ratio"] > 1.0


def test_a_validation_warns_of_the_same_as_an_operation(service: RunningService) -> None:
    """Limits without tolerances or for planned positions alone, speed zones among them, and motion at the ends."""
    sets = {"friction": 2.0, "friction_tolerance": 1.0, "following_error": 1e-3}
    added = service.post(
        "/v1/robots", {"kind": "derived", "id": "warned_of", "from": "ur5e", "limits": {"elbow_joint": sets}}
    )
    assert added.status_code == 201, added.text
    wall = {"id": "wall", "shape": {"kind": "box", "size": [0.1, 1.0, 1.0]}, "pose": {"position": [1.5, 0.0, 0.5]}}
    positions = [[0.0, -1.2, 1.4, -0.4, 1.0, 0.0], [0.2, -1.2, 1.4, -0.4, 1.0, 0.0], [0.4, -1.2, 1.4, -0.4, 1.0, 0.0]]
    velocities = [[0.1, 0.0, 0.0, 0.0, 0.0, 0.0]] * 3
    trajectory = {"samples": {"time": [0.0, 2.0, 4.0], "position": positions, "velocity": velocities}}
    shared = {
        "robot": added.json()["id"],
        "limits": {"total_power": 1e5},
        "scene": {"objects": [wall]},
        "speed_zones": [{"clearance": 1.0, "speed": 0.5}],
    }
    motion = {"initial_velocity": velocities[0], "final_velocity": velocities[0]}
    validated = checked(service.post(VALIDATE, shared | trajectory | motion), trajectory_operations.ValidationAnswer)
    operated = service.post("/v1/trajectories/slice", shared | {"trajectory": trajectory})
    assert operated.status_code == 200, operated.text
    both = (sorted(answer["warnings"], key=str) for answer in (validated, operated.json()))
    assert next(both) == next(both)
    found = {warning["code"]: warning["message"] for warning in validated["warnings"]}
    assert {"following_error_not_covered", "tolerances_not_covered", "starts_in_motion", "ends_in_motion"} < set(found)
    assert "speed_zones" in found["following_error_not_covered"]
    at_rest = service.post(VALIDATE, {"robot": "ur5e"} | trajectory).json()
    assert at_rest["warnings"] == []
