"""The same plan in other forms."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

import numpy as np
import pytest

from api.contract.ros import RosJointTrajectory
from api.work.answers.formats import FORMATS
from api.work.answers.views import VIEWS
from tests.api.requests import PARTS, plan_request

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

PATH = "/v1/trajectories"
JSON, CSV, ROS = "application/json", "text/csv", "application/vnd.ros2.joint-trajectory+json"


@pytest.mark.parametrize(
    ("accept", "media_type"),
    [
        ("*/*", JSON),
        ("application/*", JSON),
        (JSON, JSON),
        ("text/*", CSV),
        (CSV, CSV),
        (ROS, ROS),
        ("text/csv;q=0.5, application/json;q=0.4", CSV),
        ("text/csv;q=0.5, application/json", JSON),
        ("application/json;q=0, */*;q=0.1", CSV),
        ("image/gif, text/csv;q=0.1", CSV),
        ("TEXT/CSV", CSV),
    ],
)
def test_accept_chooses_the_form(service: RunningService, accept: str, media_type: str) -> None:
    answer = service.post(PATH, plan_request(), headers={"Accept": accept})
    assert answer.status_code == 200
    assert answer.headers["Content-Type"].partition(";")[0] == media_type


@pytest.mark.parametrize(("name", "media_type"), [("json", JSON), ("csv", CSV), ("ros2", ROS)])
def test_the_query_goes_before_accept(service: RunningService, name: str, media_type: str) -> None:
    answer = service.post(f"{PATH}?format={name}", plan_request(), headers={"Accept": "image/gif"})
    assert answer.headers["Content-Type"].partition(";")[0] == media_type


@pytest.mark.parametrize("part", PARTS)
def test_every_part_can_be_included(service: RunningService, part: str) -> None:
    request = plan_request(include=[part], payload={"mass": 0.1})
    plain = service.post(PATH, plan_request(payload={"mass": 0.1})).json()
    answer = service.post(PATH, request).json()
    assert (set(answer) - set(plain)) | (set(answer["samples"]) - set(plain["samples"])) == {part}


def test_what_there_is_not_is_refused_with_what_there_is(service: RunningService) -> None:
    unknown = [{"params": {"format": name}} for name in ("xlsx", "jbi", "val3", "fanuc_tp")]
    for options in ({"headers": {"Accept": "image/gif"}}, *unknown):
        answer = service.post(PATH, plan_request(), **options)
        problem = answer.json()
        assert (answer.status_code, problem["code"]) == (406, "not_acceptable")
        assert problem["formats"] == [*FORMATS, *VIEWS]
        assert all(name in problem["detail"] for name in FORMATS)


def test_problems_stay_problems(service: RunningService) -> None:
    answer = service.post(f"{PATH}?format=csv", plan_request(waypoints=[]))
    assert answer.headers["Content-Type"] == "application/problem+json"


def test_all_forms_hold_the_same_samples(service: RunningService) -> None:
    samples = service.post(PATH, plan_request()).json()["samples"]
    table = list(csv.reader(io.StringIO(service.post(f"{PATH}?format=csv", plan_request()).text)))
    columns = dict(zip(table[0], np.array(table[1:], dtype=float).T, strict=True))
    np.testing.assert_array_equal(columns["time"], samples["time"])
    np.testing.assert_array_equal(columns["position.joint_1"], np.array(samples["position"])[:, 0])
    ros = service.post(f"{PATH}?format=ros2", plan_request())
    RosJointTrajectory.model_validate_json(ros.content, strict=True)
    points = ros.json()["points"]
    np.testing.assert_array_equal([point["positions"] for point in points], samples["position"])
    times = [point["time_from_start"]["sec"] + 1e-9 * point["time_from_start"]["nanosec"] for point in points]
    np.testing.assert_allclose(times, samples["time"], rtol=0.0, atol=1e-9)


def test_a_format_that_cannot_carry_the_plan_is_refused(service: RunningService) -> None:
    """URScript moves six joints; the arm has three."""
    answer = service.post(f"{PATH}?format=urscript", plan_request())
    assert (answer.status_code, answer.json()["code"]) == (422, "unsupported_format")
