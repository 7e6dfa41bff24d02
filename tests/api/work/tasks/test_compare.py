"""POST /v1/trajectories/compare: the same waypoints through several back ends."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from planner.backends import BACKENDS
from tests.api.requests import joint, plan_request

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

COMPARE = "/v1/trajectories/compare"
PLAN = "/v1/trajectories"


def compare_request(*backends: dict[str, Any], **changes: Any) -> dict[str, Any]:
    request = plan_request(**changes)
    del request["backend"]
    return request | {"backends": list(backends)}


def test_every_result_is_what_the_back_end_plans_alone(service: RunningService) -> None:
    backends = [{"kind": kind} for kind in BACKENDS if kind != "min_effort"]
    include = ["jerk", "polynomials"]
    answer = service.post(COMPARE, compare_request(*backends, include=include))
    assert answer.status_code == 200
    results = answer.json()["results"]
    assert [result["backend"] for result in results] == [backend["kind"] for backend in backends]
    for result, backend in zip(results, backends, strict=True):
        assert (result["status"], result["problem"]) == ("planned", None)
        alone = service.post(PLAN, plan_request(backend=backend, include=include)).json()
        assert result["trajectory"] == alone
        assert result["duration"] == alone["duration"]
        assert result["waypoint_error"] == alone["certificate"]["waypoint_error"]


def test_both_solvers_of_toppra_are_compared_and_named(service: RunningService) -> None:
    """The package is at work in the workers: the answers of plans and comparisons say which solver it was."""
    waypoints = [joint(0.1, 0.2, 0.3), joint(0.5, 0.1, 0.4, transition={"kind": "through"}), joint(0.6, 0.4, 0.2)]
    backends = [{"kind": "toppra"}, {"kind": "toppra", "solver": "package"}, {"kind": "toppra", "jerk_limited": True}]
    request = compare_request(*backends, waypoints=waypoints)
    results = service.post(COMPARE, request).json()["results"]
    assert [result["trajectory"]["solver"] for result in results] == ["kernel", "package", None]
    assert results[0]["duration"] == pytest.approx(results[1]["duration"], rel=1e-5)
    for result, backend in zip(results, backends, strict=True):
        assert service.post(PLAN, plan_request(waypoints=waypoints, backend=backend)).json() == result["trajectory"]


@pytest.mark.large_only
def test_the_figures_are_those_of_the_samples(service: RunningService) -> None:
    """By numerical integration of dense samples, torques by the service's own inverse dynamics."""
    request = compare_request({"kind": "quintic"}, robot="kuka_kr16_2", include=["jerk", "torque"], sample_period=1e-3)
    request["waypoints"] = [joint(0.0, -1.5, 1.5, 0.0, 0.5, 0.0), joint(1.0, -1.2, 1.2, 0.0, 0.5, 0.5)]
    (result,) = service.post(COMPARE, request).json()["results"]
    samples = result["trajectory"]["samples"]
    time, jerk = np.array(samples["time"]), np.array(samples["jerk"])
    torque, velocity = np.array(samples["torque"]), np.array(samples["velocity"])
    limits = [entry["torque"] for entry in service.client.get("/v1/robots/kuka_kr16_2").json()["joints"]]
    assert result["peak_jerk"] == pytest.approx(np.abs(jerk).max(), rel=1e-2)
    mean_square = np.trapezoid((jerk**2).sum(axis=1), time) / result["duration"]
    assert result["rms_jerk"] == pytest.approx(np.sqrt(mean_square), rel=1e-2)
    assert result["effort"] == pytest.approx(np.trapezoid(((torque / limits) ** 2).sum(axis=1), time), rel=1e-3)
    power = np.abs(torque * velocity).sum(axis=1)
    assert result["mechanical_energy"] == pytest.approx(np.trapezoid(power, time), rel=1e-3)
    total = np.abs((torque * velocity).sum(axis=1)).max()
    assert total <= result["peak_power"] <= total * (1.0 + 1e-3)
    rms = np.sqrt(np.trapezoid(torque**2, time, axis=0) / result["duration"])
    assert result["rms_torque"] == pytest.approx(rms.tolist(), rel=1e-3)
    assert result["path_deviation"] < 1e-4


def test_laws_whose_acceleration_jumps_have_no_jerk_to_compare(service: RunningService) -> None:
    kinds = ("cubic", "quintic", "trapezoidal", "ruckig", "toppra")
    results = service.post(COMPARE, compare_request(*({"kind": kind} for kind in kinds))).json()["results"]
    bounded = {result["backend"]: result["jerk_is_bounded"] for result in results}
    assert bounded == {"cubic": False, "quintic": True, "trapezoidal": False, "ruckig": True, "toppra": False}
    for result in results:
        assert (result["peak_jerk"] is None) == (result["rms_jerk"] is None) == (not bounded[result["backend"]])


def test_one_back_end_that_refuses_does_not_keep_the_others_from_planning(service: RunningService) -> None:
    slow = joint(0.3, 0.1, 0.5, duration=1.0)
    ramps = {"kind": "trapezoidal", "acceleration_time": 2.0}
    answer = service.post(COMPARE, compare_request({"kind": "cubic"}, ramps, waypoints=[joint(0.1, 0.2, 0.3), slow]))
    good, bad = answer.json()["results"]
    assert good["status"] == "planned"
    assert (bad["status"], bad["trajectory"], bad["duration"]) == ("infeasible_duration", None, None)
    assert bad["problem"]["code"] == "infeasible_duration"
    assert bad["problem"]["remedies"]


def test_the_header_says_how_long_each_took(service: RunningService) -> None:
    answer = service.post(COMPARE, compare_request({"kind": "cubic"}, {"kind": "quintic"}))
    names = [entry.split(";")[0].strip() for entry in answer.headers["server-timing"].split(",")]
    assert {"backend_0", "backend_1", "total"} <= set(names)


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"backends": []}, "/backends"),
        ({"backends": {"kind": "cubic"}}, "/backends"),
        ({"backends": [{"kind": "cubic"}] * 17}, "/backends"),
        ({"backends": [{"kind": "cubic"}, {"kind": "bezier"}]}, "/backends/1/kind"),
        ({"backends": [{"kind": "cubic"}, {}]}, "/backends/1/kind"),
        ({"backends": [{}]}, "/backends/0/kind"),
        ({"backends": [{"kind": 7}]}, "/backends/0/kind"),
        ({"backends": [1]}, "/backends/0"),
        ({"backends": [[]]}, "/backends/0"),
        ({"backends": None}, "/backends"),
        ({"backend": {"kind": "cubic"}}, "/backend"),
        ({"robot": 3}, "/robot"),
    ],
)
def test_a_bad_request_is_refused_as_a_whole(service: RunningService, change: dict[str, Any], pointer: str) -> None:
    answer = service.post(COMPARE, compare_request({"kind": "cubic"}) | change)
    assert (answer.status_code, answer.json()["code"]) == (422, "invalid_request")
    assert answer.json()["errors"][0]["pointer"] == pointer


@pytest.mark.parametrize("backends", [[1], [{}], [[]], [None], [{"kind": 7}], [], 7, None])
def test_back_ends_of_no_kind_whose_deadline_passes_first(service: RunningService, backends: Any) -> None:
    """No worker has looked at them by then, and there is no kind to name in an entry of the results."""
    answer = service.post(COMPARE, compare_request(deadline=1e-9) | {"backends": backends})
    assert (answer.status_code, answer.json()["code"]) == (504, "deadline_exceeded")


def test_back_ends_whose_deadline_passes_first(service: RunningService) -> None:
    answer = service.post(COMPARE, compare_request({"kind": "cubic"}, {"kind": "auto"}, deadline=1e-9))
    assert answer.status_code == 200
    entries = [(result["backend"], result["status"]) for result in answer.json()["results"]]
    assert entries == [("cubic", "deadline_exceeded"), ("auto", "deadline_exceeded")]


def test_an_unknown_robot_is_refused_as_a_whole(service: RunningService) -> None:
    answer = service.post(COMPARE, compare_request({"kind": "cubic"}, robot="nobody"))
    assert (answer.status_code, answer.json()["code"]) == (404, "unknown_robot")
