"""A returned remedy is a valid request: within the bounds of the schema, and with an answer of permitted length."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import pytest

from api.contract.requests import PlanRequest
from api.pool.messages import Caps, Task
from api.work.tasks.context import TaskContext
from api.work.tasks.remedies import acceptable_remedies
from planner.errors import LimitsUnsatisfiable, Remedy
from planner.problems.problem import PolylineMotion
from planner.problems.transitions import BlendTransition, StopTransition
from planner.spatial import Pose
from tests.api.random_requests.judged_refusals import with_remedies
from tests.api.requests import joint, plan_request

if TYPE_CHECKING:
    from planner.fields import FieldPath
    from tests.api.conftest import RunningService

PLAN = "/v1/trajectories"
POSES = (Pose((0.1, 0.0, 0.0), None),)


def remedies_that_help(service: RunningService, request: dict[str, Any]) -> tuple[set[str], set[str]]:
    """Return the changes of a refusal, after a request with each of them, and its hints."""
    problem = service.post(PLAN, request).json()
    remedies = problem.get("remedies", [])
    for chosen in range(len(remedies)):
        helped = service.post(PLAN, with_remedies(request, remedies, chosen))
        assert helped.status_code == 200, helped.text
    return {remedy["change"] for remedy in remedies}, {hint["change"] for hint in problem.get("hints", [])}


@pytest.mark.parametrize(
    ("velocity", "hints"),
    [(1e-8, set()), (1e-5, {"/waypoints/1/duration"})],
    ids=["longer_than_may_be_asked", "too_many_samples"],
)
@pytest.mark.parametrize("kind", ["cubic", "ruckig"])
def test_a_duration_that_is_told_can_be_asked(
    service: RunningService, kind: str, velocity: float, hints: set[str]
) -> None:
    """0.2 rad take 2e7 s, more than the permitted 1e6 s, or 2e4 s, which give two million rows."""
    waypoints = [joint(0.1, 0.2, 0.3), joint(0.3, 0.2, 0.3, duration=5.0)]
    limits = {"velocity": [velocity, 0.5, 0.5]}
    request = plan_request(waypoints=waypoints, limits=limits, backend={"kind": kind}, sample_period=0.01)
    assert remedies_that_help(service, request) == ({"/limits/velocity/0"}, hints)


def test_what_a_comparison_says_of_a_back_end_points_to_it(service: RunningService) -> None:
    request = plan_request()
    del request["backend"]
    too_fast, of_two = ({"kind": "ruckig", "initial_velocity": [1e5] * n} for n in (3, 2))
    answer = service.post(f"{PLAN}/compare", request | {"backends": [{"kind": "cubic"}, too_fast, of_two]}).json()
    _, fast, short = (result["problem"] for result in answer["results"])
    assert [remedy["change"] for remedy in fast["remedies"]] == ["/backends/1/initial_velocity"]
    assert [fault["pointer"] for fault in short["errors"]] == ["/backends/2/initial_velocity"]


@pytest.mark.parametrize(
    ("field", "value", "takes", "told"),
    [
        (("duration",), 1e6, 2.0, "remedy"),
        (("duration",), 1.1e6, 2.0, None),
        (("duration",), 5.0, 1e5, "hint"),
        (("duration",), 5.0, None, "hint"),
        (("waypoints", 1, "duration"), 1e-7, 2.0, None),
        (("waypoints", 1, "transition"), BlendTransition(2e-5), 2.0, "remedy"),
        (("waypoints", 1, "transition"), BlendTransition(2e-6), 2.0, None),
        (("waypoints", 1, "transition"), StopTransition(), 2.0, "remedy"),
        (("waypoints", 1, "motion"), PolylineMotion(POSES, 0.01), 2.0, "remedy"),
        (("waypoints", 1, "motion"), PolylineMotion(POSES, 1e-6), 2.0, None),
        (("waypoints", 1, "position", 0), 2e6, 2.0, None),
        (("waypoints", 2, "position", 0), 0.1, 2.0, None),
        (("limits", "velocity", 0), 0.1, 2.0, "remedy"),
        (("limits", "velocity", 0), 2e9, 2.0, None),
        (("limits", "velocity_scale"), 1.1, 2.0, None),
        (("payload", "mass"), 1e-10, 2.0, None),
        (("scene", "margin"), 0.01, 2.0, None),
        (("backend", "initial_velocity"), None, 2.0, None),
    ],
)
def test_what_the_service_refuses_is_no_remedy(
    field: FieldPath, value: Any, takes: float | None, told: str | None
) -> None:
    """A named waypoint has no position, a scene that is kept no margin in the request, a cubic no initial velocity."""
    request = plan_request(
        waypoints=[joint(0.1, 0.2, 0.3), joint(0.2, 0.2, 0.3), {"kind": "named", "name": "home"}],
        limits={"velocity": [0.1, 0.1, 0.1]},
        payload={"mass": 1.0},
        scene="cell_1",
        sample_period=1e-2,
        backend={"kind": "cubic"},
    )
    task = Task("plan_trajectory", PLAN, 0.0, math.inf, json.dumps(request).encode(), {})
    context = TaskContext(task, Caps(max_deadline=60.0, max_waypoints=100, max_samples=30_000, memory_mib=1024))
    with (
        pytest.raises(LimitsUnsatisfiable) as refusal,
        acceptable_remedies(context, PlanRequest.model_validate_json(task.body), 3),
    ):
        raise LimitsUnsatisfiable("", remedies=[Remedy(field, value, "", takes)])
    assert [remedy.field for remedy in refusal.value.remedies] == ([field] if told == "remedy" else [])
    assert [hint.field for hint in refusal.value.hints] == ([field] if told == "hint" else [])
