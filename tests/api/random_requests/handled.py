"""Objects that a robot attaches and detaches along a request: fixed and moving objects on each segment."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pinocchio as pin

from tests.api.random_requests.answered import times_of
from tests.api.random_requests.poses import in_base, placement, thing_at, tool_at, written
from tests.api.random_requests.surroundings import Surroundings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.robots import Robot


class Stage(NamedTuple):
    """An interval of a plan with the same attached objects: its start and end, s, and the surroundings."""

    first: float
    last: float
    around: Surroundings


def stages(robot: Robot, request: dict[str, Any], answer: dict[str, Any]) -> Iterator[Stage]:
    """Yield the intervals of an answer; one where no object is attached or detached."""
    asked = request.get("waypoints", [])
    if not is_handled(asked):
        yield Stage(-np.inf, np.inf, Surroundings(robot, request))
        return
    times, scene = times_of(answer), request["scene"]
    for k, (before, after) in enumerate(pairwise(asked)):
        here, there = (np.array(times[j]["position"]) for j in (k, k + 1))
        released = [held for held in scene.get("attached", []) if held["id"] in before.get("detach", [])]
        scene = _after(robot, request, scene, before, here, times[k]["arrival_time"])
        around = Surroundings(robot, {**request, "scene": scene})
        around.let_near(here, {take["id"] for take in before.get("attach", [])}, None)
        around.let_near(there, set(after.get("detach", [])), None)
        for held in released:
            around.let_near(here, _holders(robot, around, held), held["id"])
        for take in after.get("attach", []):
            around.let_near(there, _holders(robot, around, take), take["id"])
        first, last = times[k]["departure_time"], times[k + 1]["arrival_time"]
        if first < last or k == len(asked) - 2:  # between equal waypoints nothing happens: the next part begins there
            yield Stage(first, last, around)


def is_handled(waypoints: list[dict[str, Any]]) -> bool:
    """Tell whether any waypoint attaches or detaches an object."""
    return any(waypoint.get("attach") or waypoint.get("detach") for waypoint in waypoints)


def _after(
    robot: Robot,
    request: dict[str, Any],
    scene: dict[str, Any],
    waypoint: dict[str, Any],
    position: np.ndarray,
    time: float,
) -> dict[str, Any]:
    """Return the scene after objects are detached at a waypoint, at a time, s, and then others attached."""
    objects, attached = list(scene.get("objects", [])), list(scene.get("attached", []))
    for name in waypoint.get("detach", []):
        (held,) = (thing for thing in attached if thing["id"] == name)
        attached.remove(held)
        pose = _frame(robot, request, held, position) * placement(held.get("pose"))
        moves: dict[str, Any] = {}
        if waypoint.get("on"):  # from then on, it moves along
            (under,) = (thing for thing in scene["objects"] if thing["id"] == waypoint["on"])
            start, now = (thing_at(robot, request, under, at) for at in (0.0, time))
            pose.translation -= now.translation - start.translation
            into = in_base(robot, request, under.get("frame", "world"))
            moves["motion"] = under["motion"] | {"velocity": (into.rotation @ under["motion"]["velocity"]).tolist()}
        objects.append(_with(held, ("id", "shape", "margin"), frame="base", pose=written(pose, "matrix"), **moves))
    for take in waypoint.get("attach", []):
        (thing,) = (thing for thing in objects if thing["id"] == take["id"])
        objects.remove(thing)
        there = thing_at(robot, request, thing, time)
        pose = _frame(robot, request, take, position).actInv(there)
        attached.append(_with(thing, ("shape", "margin"), **take, pose=written(pose, "matrix")))
    return {**scene, "objects": objects, "attached": attached}


def _with(thing: dict[str, Any], names: tuple[str, ...], **more: Any) -> dict[str, Any]:
    return {name: thing[name] for name in names if name in thing} | more


def _frame(robot: Robot, request: dict[str, Any], held: dict[str, Any], position: np.ndarray) -> pin.SE3:
    """Return the pose of the link or tool that holds an object at a joint position, in the base frame."""
    if not held.get("link"):
        return tool_at(robot, position, request.get("tool"))
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, position)
    return data.oMf[robot.model.getFrameId(held["link"])].copy()


def _holders(robot: Robot, around: Surroundings, held: dict[str, Any]) -> set[str]:
    """Return names of the bodies on the joint that holds an object, and of other links that may touch it."""
    joint = robot.model.frames[robot.model.getFrameId(held.get("link") or robot.tip_frame)].parentJoint
    return {body.name for body in around.bodies if body.joint == joint} | set(held.get("touch_links", []))
