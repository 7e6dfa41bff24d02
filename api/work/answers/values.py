"""From the library's values to the form that requests and answers have; only workers load this."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planner.kinematics.configurations import Configuration
from planner.problems.motion_around import FreeMotion
from planner.problems.moves import CartesianMove
from planner.problems.problem import JointMotion, PolylineMotion
from planner.problems.transitions import BlendTransition, StopTransition
from planner.spatial import Pose, quaternion

if TYPE_CHECKING:
    import planner
    from planner.choices import Choice
    from planner.errors import NearestPose, PathPoint

NOT_IN_REQUESTS = ("turns", "keep")
"""Fields of free motions that requests do not have, or have in another form."""


def pose_answer(pose: Pose) -> dict[str, Any]:
    """Write a pose: a quaternion, or null where any orientation will do."""
    turned = None if pose.rotation is None else {"kind": "quaternion", "xyzw": quaternion(pose.rotation).tolist()}
    return {"position": pose.position.tolist(), "orientation": turned}


def nearest_answer(nearest: NearestPose) -> dict[str, Any]:
    """Write the nearest pose found to one that cannot be reached."""
    return {
        "pose": pose_answer(nearest.pose),
        "position": nearest.position,
        "position_distance": nearest.position_error,
        "orientation_distance": nearest.orientation_error,
    }


def choice_answer(choice: Choice) -> dict[str, Any]:
    """Write the choice at a goal set."""
    return {"waypoint": choice.waypoint, "option": choice.option, "options": list(map(vars, choice.options))}


def path_point_answer(point: PathPoint) -> dict[str, Any]:
    """Write the point up to which a motion of the tool can be followed."""
    return {"fraction": point.fraction, "pose": pose_answer(point.pose), "position": point.position}


def _pose_constraint_answer(constraint: planner.PoseConstraint) -> dict[str, Any]:
    """Write a constraint on the pose of the tool as requests have it."""
    values: dict[str, Any] = {"kind": constraint.kind}
    for name, value in vars(constraint).items():
        if isinstance(value, Pose):
            values[name] = pose_answer(value)
        elif name == "orientation":
            values[name] = {"kind": "quaternion", "xyzw": list(value)}
        else:
            values[name] = list(value) if isinstance(value, tuple) else value
    return values


def value_answer(value: Any) -> Any:
    """Write a value of the library's as a client puts it into a request; numbers stay as they are."""
    match value:
        case Pose():
            return pose_answer(value)
        case CartesianMove():
            moved = pose_answer(Pose(np.array(value.translation), value.rotation))
            return {"kind": "cartesian", "translation": moved["position"], "orientation": moved["orientation"]}
        case Configuration():
            return value.names
        case FreeMotion():
            asked = {
                name: option
                for name, option in vars(value).items()
                if name not in NOT_IN_REQUESTS and option is not None
            }
            kept = list(map(_pose_constraint_answer, value.keep))
            return {"kind": "free", **asked, **({"keep": kept} if kept else {})}
        case JointMotion():
            return {"kind": "joint"}
        case StopTransition():
            return {"kind": "stop"}
        case PolylineMotion():
            poses = [pose_answer(pose) for pose in value.poses]
            return {"kind": "polyline", "poses": poses, "blend": value.blend}
        case BlendTransition():
            return {"kind": "blend", "radius": value.radius}
        case _:
            return value
