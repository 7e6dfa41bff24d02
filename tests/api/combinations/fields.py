"""The fields that the schema allows in plan requests, and the fields of one request."""

from __future__ import annotations

from inspect import get_annotations
from typing import TYPE_CHECKING

from pydantic import BaseModel

from api.contract.requests import GivenTrajectory, JointCurve, PlanRequest, SampledTrajectory
from tests.api.combinations.factors import schema

if TYPE_CHECKING:
    from collections.abc import Iterator

LEFT_OUT = {
    **dict.fromkeys(
        (
            "GoalSet.name",
            "GoalSet.kind",
            "GoalSet.options",
            "GoalSet.actions",
            "WaypointSequence.kind",
            "WaypointSequence.waypoints",
        ),
        "its options are waypoints as everywhere; test_goal_sets has them",
    ),
    "Attach.link": "the random requests have it",
    "AttachedObject.link": "the random requests have it",
    "AttachedObject.margin": "the random requests have it",
    "Convex.faces": "answers have it, and requests ignore it",
    **dict.fromkeys(
        (
            "FreeMotion.keep",
            *(f"ToolAxis.{name}" for name in ("kind", "direction", "angle", "axis")),
            *(f"ToolOrientation.{name}" for name in ("kind", "orientation", "angle")),
            *(f"ToolNearPlane.{name}" for name in ("kind", "point", "normal", "distance")),
            *(f"ToolNearLine.{name}" for name in ("kind", "point", "direction", "distance")),
            *(f"ToolInBox.{name}" for name in ("kind", "pose", "size")),
            *(f"ToolInHalfSpace.{name}" for name in ("kind", "normal", "offset")),
        ),
        "few starts and ends keep one; test_pose_constraints has them",
    ),
    "FreeMotion.time_budget": "the random requests have it; what it gives depends on the machine",
    **dict.fromkeys(
        ("Payload.mass_tolerance", "Payload.center_of_mass_tolerance", "Payload.inertia_tolerance"),
        "limits of power refuse them; test_torque_with_tolerances has them with every back end",
    ),
    "PlanRequest.picture": "it changes no plan",
    "PoseWaypoint.on": "few plans meet a moving object; test_rides has it with every back end",
    "TrajectoryRequest.repeat": "it changes no plan; test_programs has it",
    **dict.fromkeys(
        (
            *(f"WaypointList.{name}" for name in ("optimise", "time_budget", "optimise_iterates", "warm_start")),
            *(
                f"{model.__name__}.{name}"
                for model in (GivenTrajectory, SampledTrajectory, JointCurve)
                for name in model.model_fields
            ),
        ),
        "it plans many times; test_optimise has it",
    ),
    "Pose.quaternion_xyzw": "another notation of `orientation`",
    **dict.fromkeys(("ProcessForce.force", "ProcessForce.moment", "ProcessForce.frame"), "as `process_force`"),
    "Scene.allowed_pairs": "the random requests have it",
    "Scene.content": "answers have it, and requests ignore it",
    "Scene.id": "answers have it, and requests ignore it",
    **dict.fromkeys(
        (
            "SceneObject.motion",
            *(f"LinearObjectMotion.{name}" for name in ("kind", "velocity", "end")),
            *(f"TimedObjectMotion.{name}" for name in ("kind", "poses")),
            *(f"TimedPose.{name}" for name in ("time", "pose")),
        ),
        "few plans meet a moving object; test_moving_objects has them",
    ),
    "SceneObject.frame": "the random requests have it",
    **dict.fromkeys(
        ("WaypointBase.earliest_arrival", "WaypointBase.latest_arrival"),
        "test_arrivals has them with every kind of timing",
    ),
    "WaypointBase.process_force": "it may not change without a stop; test_process_forces has it with every back end",
}
"""Fields that no combined request has, and why."""


def fields_of_schema() -> set[str]:
    """Return the properties of a plan request and of all its parts, written like `Limits.velocity`."""
    models = {model.__name__: model for model in _models(BaseModel)}
    definitions = {PlanRequest.__name__: schema(), **schema()["$defs"]}
    return {
        _declared(models[name], field)
        for name, definition in definitions.items()
        for field in definition.get("properties", {})
        if name != "Picture"
    }


def fields_in(value: object) -> Iterator[str]:
    """Yield the fields that are set in a validated request, or in a part of it."""
    match value:
        case BaseModel():
            for name in value.model_fields_set:
                if (inner := getattr(value, name)) is not None:
                    yield _declared(type(value), type(value).model_fields[name].alias or name)
                    yield from fields_in(inner)
        case dict():
            for inner in value.values():
                yield from fields_in(inner)
        case list() | tuple():
            for inner in value:
                yield from fields_in(inner)


def _declared(model: type[BaseModel], field: str) -> str:
    """Return a field with the class that declares it; a field of all waypoints counts as one."""
    names = {own.alias or name: name for name, own in model.model_fields.items()}
    by = next(base for base in reversed(model.__mro__) if names[field] in get_annotations(base))
    return f"{by.__name__}.{field}"


def _models(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
    for subclass in model.__subclasses__():
        if subclass.__module__.startswith("api."):
            yield subclass
        yield from _models(subclass)
