"""Lists that programs make and people do not: repeated, mirrored, nearly equal, standing still, along one line, turning
round and round, at a limit."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.corpus.closed_form import straight_times
from benchmarks.corpus.job import Draft, Law
from benchmarks.corpus.programme import STOP, THROUGH, Programme, Untraceable
from benchmarks.corpus.tracing import tool_at
from planner.problems.problem import JointWaypoint
from planner.spatial import FloatArray, Pose

if TYPE_CHECKING:
    from benchmarks.corpus.arms import Place
    from planner.problems.transitions import Transition
    from planner.robots import Robot

TINY = (0.0, 1e-15, 1e-12, 1e-9, 1e-6)
"""rad or m that rounding leaves between numbers that should be equal."""


def swing(place: Place, *shares: float) -> FloatArray:
    """Return the joint position, every joint moved by a part of its own of 0.4 rad or 0.1 m."""
    robot = place.robot
    pattern = np.resize([1.0, -0.6, 0.8, 0.5, -0.7, 0.9, 0.3], robot.dof)
    reach = np.where(robot.is_angle, 0.4, 0.1)
    moved: FloatArray = place.position + np.resize(shares, robot.dof) * pattern * reach
    return moved


def repeats(place: Place, variant: int) -> Draft:
    """Return the same move again and again, by joints or lines; sent home where it is at home already."""
    times, kind = (2, 5, 15)[variant % 3], variant // 3 % 4
    if kind < 2:
        programme = Programme(place)
        for _ in range(times):
            programme.joints(swing(place, 1.0), transition=STOP if kind == 0 else THROUGH)
            programme.joints(place.position, transition=STOP if kind == 0 else THROUGH)
        durations = straight_times(place.robot, np.array(programme.positions)) if kind == 0 else None
        return Draft(programme, {"times": times, "through": kind == 1}, durations=durations)
    programme = Programme(place, place.at(0.0, 0.0, 0.0))
    for _ in range(times):
        programme.line(place.at(0.0, 0.1, 0.0), transition=STOP if kind == 2 else programme.blend(0.02))
        programme.line(place.at(0.1, 0.1, 0.0), transition=STOP if kind == 2 else programme.blend(0.02))
        programme.line(place.at(0.0, 0.0, 0.0))
    programme.to(place.at(0.0, 0.0, 0.0))  # where it is
    return Draft(programme, {"times": times, "lines": True})


def mirrored(place: Place, variant: int) -> Draft:
    """Make a job, and its copy turned about the base's axis, by a quarter or 0.3 rad; durations are equal."""
    angle, kind = (0.0, 0.5 * np.pi, 0.3)[variant % 3], variant // 3 % 4
    turned = place.position.copy()
    turned[0] += angle
    home = tool_at(place.robot, place.position)
    there = tool_at(place.robot, turned)
    assert home.rotation is not None and there.rotation is not None
    rotation = there.rotation @ home.rotation.T

    def at(x: float, y: float, z: float) -> Pose:
        pose = place.at(x, y, z)
        return Pose(rotation @ pose.position, None if pose.rotation is None else rotation @ pose.rotation)

    lower, upper = place.robot.limit("lower"), place.robot.limit("upper")
    if (turned < lower).any() or (turned > upper).any():
        raise Untraceable
    programme = Programme(place, turned)
    if kind == 0:
        for shares in ((1.0, 0.5), (-0.5, 1.0), (0.3,)):
            programme.joints(turned + swing(place, *shares) - place.position, transition=THROUGH)
    elif kind == 1:
        for shares in ((1.0, 0.5), (-0.5, 1.0), (0.3,)):
            programme.joints(turned + swing(place, *shares) - place.position)
    elif kind == 2:
        programme.line(at(0.0, 0.1, 0.0), transition=programme.blend(0.02))
        programme.line(at(0.0, 0.1, -0.1))
    else:
        programme.line(at(0.0, -0.1, 0.0), speed=0.02)
        programme.line(at(0.1, -0.1, 0.0), speed=0.02)
    return Draft(programme, {"angle": angle, "kind": kind}, twin=variant - variant % 3)


def near_equal(place: Place, variant: int) -> Draft:
    """Give a waypoint twice, equal or almost equal; the first of six is the list with the waypoint given once."""
    apart, kind = (None, *TINY)[variant % 6], variant // 6 % 6
    programme = Programme(place)
    transition: Transition = THROUGH if kind % 2 else STOP
    if kind < 2:
        programme.joints(swing(place, 1.0), transition=transition)
        if apart is not None:
            programme.joints(swing(place, 1.0) + apart * np.resize([1.0, -1.0], place.robot.dof), transition=transition)
        programme.joints(swing(place, -0.5, 1.0))
    elif kind < 4:
        programme.to(place.at(0.0, 0.1, 0.1), transition=transition)
        if apart is not None:
            programme.to(place.at(apart, 0.1, 0.1 - apart), transition=transition)
        programme.to(place.at(0.1, 0.0, 0.0))
    else:
        transition = STOP if kind == 4 else programme.blend(0.01)
        programme.line(place.at(0.0, 0.1, 0.0), transition=transition)
        if apart is not None:
            programme.line(place.at(0.0, 0.1 + apart, 0.0), transition=STOP)
        programme.line(place.at(0.1, 0.1, 0.0))
    kinds = ("joint", "joint", "pose", "pose", "line", "line")
    parameters: dict[str, object] = {"apart": apart, "kind": kinds[kind], "transition": type(transition).__name__}
    # A blend that a stop follows is not what it was alone, and to go 1e-6 from rest to rest takes its time.
    alike = kind < 5 and apart != TINY[-1]
    return Draft(programme, parameters, twin=variant - variant % 6 if alike else None)


def still_joints(place: Place, variant: int) -> Draft:
    """Return some joints stand still, exactly or but for rounding, while the others pass waypoints."""
    apart, kind = TINY[variant % 5], variant // 5 % 4
    transition = THROUGH if kind % 2 else STOP
    dof = place.robot.dof
    moving = np.arange(dof) < max(1, dof // 2) if kind < 2 else np.arange(dof) == dof - 1
    programme = Programme(place)
    for k, share in enumerate((0.5, 1.0, 0.2, -0.6), start=1):
        rounding = apart * (-1) ** k
        programme.joints(np.where(moving, swing(place, share), place.position + rounding), transition=transition)
    durations = straight_times(place.robot, np.array(programme.positions)) if transition is STOP else None
    parameters: dict[str, object] = {"apart": apart, "moving": moving.tolist(), "through": transition is THROUGH}
    return Draft(programme, parameters, twin=variant - variant % 5, durations=durations)


def one_direction(place: Place, variant: int) -> Draft:
    """Return all waypoints on one straight line in joint space: passed, it takes as long as without them."""
    count, passed = (1, 2, 10, 40)[variant % 4], variant // 4 % 2 == 0
    uneven = variant // 8 % 2 == 1
    shares = np.linspace(-1.0, 1.0, count + 2)
    if uneven:
        shares = np.sign(shares) * shares**2
    programme = Programme(place, swing(place, -1.0))
    for share in shares[1:]:
        programme.joints(swing(place, share), transition=THROUGH if passed else STOP)
    ends = np.array(programme.positions)
    durations = straight_times(place.robot, ends[[0, -1]] if passed else ends)
    if passed:  # a spline through the waypoints need not keep to the line
        durations = {law: durations[law] for law in ("trapezoidal", "s_curve")}
    return Draft(programme, {"points": count, "through": passed, "uneven": uneven}, durations=durations)


def whole_turns(place: Place, variant: int) -> Draft:
    """Turn joints by more than a whole turn where they can, one or all; then request a pose."""
    robot, turns = place.robot, (1, 2, -1)[variant % 3]
    lower, upper = robot.limit("lower"), robot.limit("upper")
    room = np.where(robot.is_angle, np.where(np.sign(turns) > 0, upper - place.position, place.position - lower), 0.0)
    able = np.flatnonzero(room > abs(turns) * 2.0 * np.pi)
    if len(able) == 0:
        able = np.array([robot.dof - 1])
        turn = 0.9 * np.sign(turns) * room[-1]
    else:
        turn = turns * 2.0 * np.pi
    end = place.position.copy()
    end[able[-1:] if variant // 3 % 2 else able] += turn
    programme = Programme(place)
    programme.joints(end)
    kind = variant // 6 % 2
    durations = straight_times(robot, np.array(programme.positions)) if kind == 0 else None
    if kind == 1:
        programme.to(programme.pose)
        beside = programme.pose.position + 0.1 * place.size * place.axes[:, 1]
        programme.line(Pose(beside, programme.pose.rotation))
    return Draft(programme, {"turn": float(turn), "joints": able.tolist()}, durations=durations)


def outside_limit(place: Place, variant: int) -> Draft:
    """Make a start that rounding has put outside a position limit, below or above, of one joint or of all."""
    beyond, kind = TINY[1:][variant % 4], variant // 4 % 4
    robot = with_ranges(place)
    lower, upper = robot.limit("lower"), robot.limit("upper")
    edge = upper + beyond if kind % 2 else lower - beyond
    start = np.where(np.arange(robot.dof) == robot.dof - 1, edge, place.position) if kind < 2 else edge
    programme = Programme(replace(place, robot=robot))
    programme.joints(swing(place, 0.5))
    programme.positions[0] = np.clip(start, lower, upper)
    first = programme.waypoints[0]
    assert isinstance(first, JointWaypoint)
    programme.waypoints[0] = replace(first, position=tuple(start.tolist()))
    durations = straight_times(robot, np.array(programme.positions))
    return Draft(programme, {"beyond": beyond, "kind": kind}, durations=durations)


def start_is_goal(place: Place, variant: int) -> Draft:
    """Send the robot to its own place: joints, pose or line; a duration or a dwell is a rest."""
    kind, asked = variant % 3, variant // 3 % 4
    here = place.at(0.0, 0.0, 0.0)
    programme = Programme(place) if kind == 0 else Programme(place, here)
    options: dict[str, float] = {}
    if asked == 1:
        options = {"duration": 2.0}
    elif asked == 2:
        options = {"dwell": 2.0}
    if kind == 0:
        programme.joints(place.position, **options)
    elif kind == 1:
        programme.to(here, **options)
    else:
        programme.line(here, **options)
    rest = 2.0 if options else 0.01
    laws: tuple[Law, ...] = ("cubic", "quintic", "trapezoidal", "s_curve")
    durations = dict.fromkeys(laws, rest)
    if asked == 3:
        programme.joints(swing(place, 0.5))
        return Draft(programme, {"kind": kind, "then": "on"})
    return Draft(programme, {"kind": kind, **options}, durations=durations)


def fixed_axis(place: Place, variant: int) -> Draft:
    """Return a palletiser's arm: one axis of the wrist cannot move, and the tool stays down."""
    robot, kind = place.robot, variant % 3
    fixed = {"kuka_kr16_l6_2": 3, "ngv_refuelling_arm": 3, "ur5": 4, "panda": 2}.get(robot.id, robot.dof - 1)
    held = float(place.position[fixed])
    joints = list(robot.joints)
    joints[fixed] = replace(joints[fixed], kind="revolute", lower=held, upper=held)
    there = replace(place, robot=replace(robot, joints=tuple(joints)))
    programme = Programme(there)
    if kind == 0 or robot.dof == 3 or robot.id == "date_sorting_arm":
        for shares in ((1.0, 0.5), (-0.5, 1.0), (0.3,)):
            q = swing(place, *shares)
            q[fixed] = held
            programme.joints(q, transition=THROUGH if variant // 3 % 2 else STOP)
    else:
        for y in (0.15, -0.1):
            programme.to(there.at(0.0, y, 0.1))
            move = programme.line if kind == 1 else programme.to
            move(there.at(0.0, y, -0.05))
            move(there.at(0.0, y, 0.1))
    return Draft(programme, {"fixed": fixed, "kind": kind})


def with_ranges(place: Place) -> Robot:
    """Return the robot; joints without position limits get some, half a turn to either side of the joint position."""
    joints = (
        joint if np.isfinite(joint.upper) else replace(joint, kind="revolute", lower=q - np.pi, upper=q + np.pi)
        for joint, q in zip(place.robot.joints, place.position.tolist(), strict=True)
    )
    return replace(place.robot, joints=tuple(joints))


FAMILIES = {
    "repeats": repeats,
    "mirrored": mirrored,
    "near_equal": near_equal,
    "still_joints": still_joints,
    "one_direction": one_direction,
    "whole_turns": whole_turns,
    "outside_limit": outside_limit,
    "start_is_goal": start_is_goal,
    "fixed_axis": fixed_axis,
}
