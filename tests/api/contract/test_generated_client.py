"""A client generated from the OpenAPI document by openapi-python-client plans and understands problems."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

import pytest

from clients.generate import GENERATORS
from tests.api.requests import plan_request

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.api.conftest import RunningService

PACKAGE = "planner_client_under_test"

pytestmark = pytest.mark.large_only


@pytest.fixture(scope="module")
def client(service: RunningService, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    folder = tmp_path_factory.mktemp("generated")
    document = folder / "openapi.json"
    document.write_bytes(service.client.get("/openapi.json").content)
    GENERATORS["python"](document, folder / PACKAGE)
    sys.path.insert(0, str(folder))
    with import_module(f"{PACKAGE}.client").Client(base_url=service.url) as client:
        yield client
    sys.path.remove(str(folder))


def generated(module: str) -> Any:
    return import_module(f"{PACKAGE}.{module}")


def test_a_plan(service: RunningService, client: Any) -> None:
    request = plan_request(include=["jerk", "polynomials"])
    models = generated("models")
    body = models.PlanRequest(
        robot=request["robot"],
        waypoints=[
            models.JointWaypoint(kind="joint", position=waypoint["position"]) for waypoint in request["waypoints"]
        ],
        backend=models.CubicBackend(kind="cubic"),
        include=[models.Include.JERK, models.Include.POLYNOMIALS],
    )
    answer = generated("api.trajectories.plan_trajectory").sync(client=client, body=body)
    assert isinstance(answer, models.PlanAnswer)
    assert answer.to_dict() == service.post("/v1/trajectories", request).json()
    assert answer.certificate.satisfied is True


def test_a_file(service: RunningService, client: Any) -> None:
    """In a form that is not JSON, which the operation for plans would not read."""
    models = generated("models")
    body, form = models.PlanRequest.from_dict(plan_request()), models.ExportTrajectoryPlanFormat.CSV
    file = generated("api.trajectories.export_trajectory").sync(client=client, body=body, format_=form)
    answer = service.post("/v1/trajectories?format=csv", plan_request())
    assert file.payload.read() == answer.content
    with pytest.raises(AttributeError):
        models.PlanTrajectoryPlanFormat  # noqa: B018 - there is none to choose


def test_unions_are_read_back_as_what_they_are(client: Any) -> None:
    models = generated("models")
    body = models.PlanRequest.from_dict(
        plan_request(
            backend={"kind": "trapezoidal", "acceleration_time": 0.5},
            waypoints=[
                {"kind": "joint", "position": [0.0, 0.0, 0.0]},
                {"kind": "pose", "pose": {"position": [1, 0, 0], "orientation": {"kind": "rpy", "rpy": [0, 0, 0]}}},
                {"kind": "relative", "frame": "tool", "move": {"kind": "spherical", "r": 1, "beta": 0, "gamma": 0}},
            ],
        )
    )
    assert isinstance(body.backend, models.TrapezoidalBackend)
    kinds = [models.JointWaypoint, models.PoseWaypoint, models.RelativeWaypoint]
    assert [type(waypoint) for waypoint in body.waypoints] == kinds
    assert isinstance(body.waypoints[1].pose.orientation, models.RpyOrientation)
    assert isinstance(body.waypoints[2].move, models.SphericalMove)


def test_a_problem(client: Any) -> None:
    models = generated("models")
    body = models.PlanRequest.from_dict(plan_request(robot="nobody"))
    answer = generated("api.trajectories.plan_trajectory").sync(client=client, body=body)
    assert isinstance(answer, models.ProblemDocument)
    assert answer.code == "unknown_robot"


def test_robots(client: Any) -> None:
    models = generated("models")
    listed = generated("api.robots.list_robots").sync(client=client)
    assert "three_dof_arm" in [robot.id for robot in listed.robots]
    row = models.DhJoint(kind=models.DhJointKind.REVOLUTE, theta=0.0, d=0.0, a=1.0, alpha=0.0)
    robot = models.DhRobot(kind="dh", convention=models.DhRobotConvention.STANDARD, joints=[row], id="one_link")
    added = generated("api.robots.add_robot").sync(client=client, body=robot)
    assert isinstance(added, models.AddedRobot)
    assert generated("api.robots.delete_robot").sync_detailed(client=client, id="one_link").status_code == 204
