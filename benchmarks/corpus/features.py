"""Jobs that need what robot programmers ask for besides: splines, open goals, two tools, rails, limits that differ."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.corpus.degenerate import swing
from benchmarks.corpus.job import Draft
from benchmarks.corpus.programme import STOP, Programme
from benchmarks.corpus.tracing import tool_at
from planner.kinematics.options import InverseKinematicsOptions
from planner.limits import Limits
from planner.problems.actions import AtDistance, AtWaypoint, SetOutput, Wait
from planner.problems.problem import LinearMotion, PoseWaypoint
from planner.problems.regions import Free, Region
from planner.problems.transitions import ThroughTransition
from planner.robots import ExternalAxis
from planner.spatial import FloatArray, Pose, rotation_x, rotation_z

if TYPE_CHECKING:
    from benchmarks.corpus.arms import Place

RAIL_LENGTH = 4.0
"""Length of a rail, in lengths of a job."""


def embossing(place: Place, variant: int) -> Draft:
    """Move a tool along one spline through points of a wave, at a speed, with or without a tilt."""
    count, speed = (3, 6, 12)[variant % 3], (0.05, 0.2)[variant % 2]
    t = np.linspace(0.0, 1.0, count + 1)
    heights = (0.02, 0.05)[variant // 3 % 2] * np.sin(2.0 * np.pi * t)
    points = np.column_stack([-0.15 + 0.3 * t, heights, 0.3 * heights])
    programme = Programme(place, place.at(*points[0]))
    programme.spline([place.at(*point) for point in points[1:]], speed)
    return Draft(programme, {"points": count, "speed": speed})


def round_nozzle(place: Place, variant: int) -> Draft:
    """Move a nozzle whose turn about its own axis is free, at the ends and between, given at random turns."""
    rng, speed = np.random.default_rng(variant), (0.1, 0.3)[variant % 2]
    free: Free | None = "rotation_z" if place.pose.rotation is not None else None
    programme = Programme(place)
    for k in range(4):
        pose = place.at(*(0.1 * np.array([np.cos(1.6 * k), np.sin(1.6 * k), 0.3 * (k % 2)])))
        if k % 2:
            programme.line(pose, speed=speed)
            motion = LinearMotion(free=free)
            programme.change_last(motion=motion)
        else:
            programme.to(pose)
        if pose.rotation is not None:
            written = Pose(pose.position, pose.rotation @ rotation_z(rng.uniform(-3.0, 3.0)))
            programme.change_last(pose=written, free=free)
    return Draft(programme, {"speed": speed})


def gripping_anywhere(place: Place, variant: int) -> Draft:
    """Return bars that may be taken anywhere along them, a little askew, and put down anywhere on a strip."""
    width, askew = (0.02, 0.05)[variant % 2] * place.size, (0.05, 0.2)[variant // 2 % 2]
    region = Region(y=(-width, width), rotation_x=(-askew, askew)) if place.pose.rotation is not None else None
    programme = Programme(place)
    for k in range(3):
        x, y = 0.12 * np.cos(2.0 * k), 0.12 * np.sin(2.0 * k)
        programme.to(place.at(x, y, 0.08), transition=STOP)
        programme.to(place.at(x, y, 0.0))
        if region is not None:
            programme.change_last(free=region)
    programme.joints(place.position)
    return Draft(programme, {"width": width, "askew": askew})


def two_tools(place: Place, variant: int) -> Draft:
    """Point a camera at a part, then grip it with the gripper beside the camera: each waypoint names its tool."""
    camera = Pose(place.size * np.array([0.05, 0.0, 0.08]), rotation_x((0.0, 0.3)[variant % 2]))
    gripper = Pose(place.size * np.array([0.0, 0.0, 0.15]), np.eye(3))
    programme = Programme(place)
    for k in range(4):
        x, y = 0.1 * (k % 2) - 0.05, 0.08 * (k // 2) - (0.05, 0.1)[variant // 2 % 2]
        for tool, height in ((camera, 0.06), (gripper, 0.0)):
            programme.to(place.at(x, y, height))
            seen = tool_at(place.robot.with_tool(tool), programme.positions[-1])
            programme.change_last(pose=seen if place.pose.rotation is not None else Pose(seen.position), tool=tool)
    return Draft(programme, {"tilted": bool(variant % 2)})


def along_a_rail(place: Place, variant: int) -> Draft:
    """Move in lines along a rail, longer than the arm: the rail free, fixed at the ends, or still."""
    pinned, prefer, length = variant % 3 == 1, variant % 3 == 2, (0.5, 1.5)[variant // 3 % 2]
    direction, middle = place.axes[:, 1], RAIL_LENGTH / 2.0 * place.size
    rail = ExternalAxis("rail", "prismatic", direction.tolist(), lower=0.0, upper=2.0 * middle, velocity=1.0, mass=10.0)
    robot = place.robot.derived(external_axes=[rail])
    on_rail = replace(
        place,
        robot=robot,
        position=np.array([middle, *place.position]),
        pose=Pose(place.pose.position + middle * direction, place.pose.rotation),
    )
    programme = Programme(on_rail)
    if prefer:
        programme.options = InverseKinematicsOptions(prefer="arm")
    for y in (-length, length, 0.0):
        position: FloatArray = np.array([middle + y * place.size, *place.position])
        pose = on_rail.at(0.0, y, 0.0)
        pins = {"rail": float(position[0])} if pinned else None
        programme.known(PoseWaypoint(pose=pose, motion=LinearMotion(), external=pins), position)
    return Draft(programme, {"pinned": pinned, "prefer": prefer, "length": length})


def past_a_switch(place: Place, variant: int) -> Draft:
    """Return joint motions that pass a waypoint at a requested velocity."""
    share, robot = (0.02, 0.05, 0.1)[variant % 3], place.robot
    velocity = np.where(np.isfinite(robot.limit("velocity")), robot.limit("velocity"), 1.0)
    lower, upper = robot.limit("lower"), robot.limit("upper")
    reach = np.minimum((0.2, 0.3)[variant // 3 % 2], 0.2 * (upper - lower))
    turn = reach * np.where(np.arange(robot.dof) % 2, -1.0, 1.0)
    middle = np.clip(place.position, lower + 1.1 * reach, upper - 1.1 * reach)
    programme = Programme(place, middle - turn)
    programme.joints(middle, transition=ThroughTransition(share * velocity * np.sign(turn)))
    programme.joints(middle + turn)
    return Draft(programme, {"share": share})


def full_cups(place: Place, variant: int) -> Draft:
    """Return a tray along lines whose corners are cut: its acceleration and its jerk are limited."""
    acceleration, jerk = (0.5, 1.5)[variant % 2], (2.0, 10.0)[variant // 2 % 2]
    programme = Programme(place, place.at(-0.1, -0.1, 0.0))
    for x, y in ((0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)):
        programme.line(place.at(x, y, 0.0), transition=programme.blend(0.03))
    limits = Limits(tcp_linear_acceleration=acceleration, tcp_linear_jerk=jerk)
    return Draft(programme, {"acceleration": acceleration, "jerk": jerk}, limits)


def teaching(place: Place, variant: int) -> Draft:
    """Return a programme at a speed override, with the tool no faster than 250 mm/s."""
    override = (0.03, 0.1, 0.3)[variant % 3]
    programme = Programme(place)
    for y, z in ((-0.15, 0.0), (0.15, 0.0)):
        programme.to(place.at(0.0, y, z + 0.1))
        programme.line(place.at(0.0, y, z), dwell=0.2)
        programme.line(place.at(0.0, y, z + 0.1))
    programme.joints(place.position)
    limits = Limits(velocity_scale=override, tcp_linear_velocity=0.25)
    return Draft(programme, {"override": override}, limits)


def downhill(place: Place, variant: int) -> Draft:
    """Return an arm that may go faster one way than the other, and brake harder than it gathers speed."""
    share, harder = (0.2, 0.6)[variant % 2], (0.3, 0.8, 1.0)[variant // 2 % 3]
    programme = Programme(place)
    for k in (1.0, -0.5, 0.7):
        programme.joints(swing(place, k), transition=STOP if variant % 3 else ThroughTransition())
    programme.joints(place.position)
    programme.line(place.at(0.05, 0.05, 0.05))
    speeds, rates = (_finite(place.robot.limit(name)) for name in ("velocity", "acceleration"))
    limits = Limits(
        velocity_range=tuple((-speed, share * speed) for speed in speeds),
        acceleration_range=tuple((-rate, harder * rate) for rate in rates),
    )
    return Draft(programme, {"share": share, "harder": harder}, limits)


def locked_wrist(place: Place, variant: int) -> Draft:
    """Lock the last joint, and set outputs with waits: a group of the other joints."""
    robot, last, wait = place.robot, place.robot.joint_names[-1], (0.1, 0.3, 1.0)[variant % 3]
    rest = place.position[:-1]
    group = robot.derived(locked={last: float(place.position[-1])})
    own = replace(place, robot=group, position=rest, pose=tool_at(group, rest))
    programme = Programme(own)
    for k, share in enumerate((0.8, -0.4, 0.6)):
        passing = ThroughTransition() if variant % 2 and k == 1 else STOP
        programme.joints(swing(own, share), transition=passing, dwell=0.0 if k else wait)
    programme.joints(rest)
    actions = (
        SetOutput(AtDistance(0.02 * place.size), "valve", value=True),
        SetOutput(AtWaypoint(1), "gripper", value=bool(variant // 2 % 2)),
        Wait(AtWaypoint(1), wait),
    )
    return Draft(programme, {"locked": last, "wait": wait}, actions=actions)


def _finite(limits: FloatArray) -> list[float]:
    return [float(limit) for limit in np.where(np.isfinite(limits), limits, 1.0)]


FAMILIES = {
    "embossing": embossing,
    "round_nozzle": round_nozzle,
    "gripping_anywhere": gripping_anywhere,
    "two_tools": two_tools,
    "along_a_rail": along_a_rail,
    "past_a_switch": past_a_switch,
    "full_cups": full_cups,
    "teaching": teaching,
    "downhill": downhill,
    "locked_wrist": locked_wrist,
}
