"""A belt with a part, and the tool of a plan seen from the part: by Pinocchio and the motion of the part alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin

import planner
from planner.spatial import FloatArray, Pose

HOME = (0.8, -1.2, 1.4, -1.77, -1.57, 0.0)
PLACE = (-0.8, -1.2, 1.4, -1.77, -1.57, 0.0)
DOWN = np.diag([1.0, -1.0, -1.0])
ABOVE, GRIP = Pose([0.0, 0.0, 0.15], DOWN), Pose([0.0, 0.0, 0.035], DOWN)
LINE = planner.LinearMotion()
ARM = planner.load_robot("ur5e")

ONCE = planner.Budget(attempts=1)
"""The budget of one plan, without a sooner arrival and a latest start."""


def part(
    position: Any = (-0.5, -0.9, 0.15), velocity: Any = (0.0, 0.2, 0.0), end: float | None = None, turn: float = 0.0
) -> planner.SceneObject:
    """Return a box on a belt."""
    motion = planner.ConstantVelocity(velocity, end)
    return planner.SceneObject("part", [planner.Box([0.06] * 3)], Pose.from_rpy(position, [0, 0, turn]), motion=motion)


def on(pose: Pose, thing: str = "part", **more: Any) -> planner.PoseWaypoint:
    """Return a waypoint on a part."""
    return planner.PoseWaypoint(pose, on=thing, **more)


def pick(
    earliest: float = 0.0, latest: float | None = None, dwell: float = 0.2, thing: str = "part"
) -> list[planner.Waypoint]:
    """Return waypoints that meet a part, take it, and lift it."""
    return [
        on(ABOVE, thing, earliest_arrival=earliest, latest_arrival=latest),
        on(GRIP, thing, motion=LINE, dwell=dwell, attach=[planner.Attach(thing)]),
        on(ABOVE, thing, motion=LINE),
    ]


def problem(
    thing: planner.SceneObject,
    waypoints: Any,
    *others: planner.SceneObject,
    robot: planner.Robot = ARM,
    home: Any = HOME,
    place: Any = PLACE,
    **more: Any,
) -> planner.PlanningProblem:
    """Return the problem of a part, from home to where it is placed."""
    scene = planner.Scene([thing, *others], margin=0.005)
    return planner.PlanningProblem(robot, [home, *waypoints, place], scene=scene, **more)


def seen_from_part(plan: planner.Plan, thing: planner.SceneObject, times: FloatArray) -> list[pin.SE3]:
    """Return the placements of the tool on a part, as if it were not taken, at times, s."""
    robot = plan.problem.robot
    base = robot.mounting or Pose(np.zeros(3), np.eye(3))
    data, rotation = robot.model.createData(), thing.pose.rotation
    assert rotation is not None
    assert base.rotation is not None
    assert thing.motion is not None
    velocity = np.asarray(thing.motion.velocity)  # type: ignore[union-attr]
    found = []
    for time, q in zip(times.tolist(), plan.trajectory.evaluate(times, [0])[0], strict=True):
        pin.framesForwardKinematics(robot.model, data, q)
        tool = pin.SE3(base.rotation, base.position) * data.oMf[robot.tool_frame_id]
        found.append(pin.SE3(rotation, thing.pose.position + time * velocity).actInv(tool))
    return found


def off_part(plan: planner.Plan, thing: planner.SceneObject, count: int = 60) -> tuple[float, float]:
    """Return the largest distance, m, and angle, rad, of the tool from its path on a part, at samples."""
    requested = waypoints_on_part(plan, thing)
    times, poses = [], []
    for row, (k, pose) in enumerate(requested):
        arrival, departure = plan.trajectory.arrivals[k], plan.trajectory.departures[k]
        times += np.linspace(arrival, departure, count).tolist()
        poses += [(pose, pose)] * count
        if row + 1 < len(requested) and requested[row + 1][0] == k + 1:
            times += np.linspace(departure, plan.trajectory.arrivals[k + 1], count).tolist()
            poses += [(pose, requested[row + 1][1])] * count
    far, turned = 0.0, 0.0
    for seen, (start, end) in zip(seen_from_part(plan, thing, np.array(times)), poses, strict=True):
        way, gone = end.position - start.position, seen.translation - start.position
        share = 0.0 if not way.any() else float(np.clip(gone @ way / (way @ way), 0.0, 1.0))
        far = max(far, float(np.linalg.norm(gone - share * way)))
        assert start.rotation is not None
        turned = max(turned, float(np.linalg.norm(pin.log3(start.rotation.T @ seen.rotation))))
    return far, turned


def waypoints_on_part(plan: planner.Plan, thing: planner.SceneObject) -> list[tuple[int, Pose]]:
    """Return the rows in a plan of the waypoints on a part, and their poses on it."""
    rows = []
    for k, waypoint in enumerate(plan.problem.waypoints):
        requested = getattr(waypoint, "requested", waypoint)
        if isinstance(requested, planner.PoseWaypoint) and requested.on == thing.id:
            rows.append((k, requested.pose))
    return rows


def later(thing: planner.SceneObject, seconds: float) -> planner.SceneObject:
    """Return a part as it is some seconds later."""
    velocity = np.asarray(thing.motion.velocity)  # type: ignore[union-attr]
    return replace(thing, pose=Pose(thing.pose.position + seconds * velocity, thing.pose.rotation))
