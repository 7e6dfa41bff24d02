"""From requests (schemas) to problems (the library's values)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

import planner
from api.contract.parts import common, free_motions, goal_sets, waypoints
from api.work.conversion.actions import to_actions, with_waits
from api.work.conversion.given_trajectories import to_trajectory
from api.work.conversion.goal_sets import to_requested_waypoint
from api.work.conversion.poses import to_pose, to_pose_constraint, to_rotation, with_axes, with_tuples
from api.work.conversion.scenes import to_scene, to_speed_zones
from planner.backends import BACKENDS, BackEnd
from planner.certificate import EndStates
from planner.errors import InvalidProblem
from planner.kinematics.configurations import Configuration
from planner.kinematics.options import InverseKinematicsOptions
from planner.limits import Limits
from planner.problems.motion_around import FreeMotion
from planner.problems.residual_vibration import ResidualVibration
from planner.robots.payload import Payload, ProcessForce
from planner.scene import Attach
from planner.spatial import FloatArray, Pose

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from api.contract import requests
    from planner import FieldPath
    from planner.robots import Robot

BASE = "base"
"""The name of the frame that poses are in unless another one is named."""

WORLD = "world"
"""The name of the frame in which robots are mounted."""

TOOL = "tool"
"""The name of the axes of the tool, for process forces."""

OWN_FRAMES = {BASE, WORLD}
"""The names of the frames that are always there."""


def to_planning_problem(request: requests.PlanRequest, robot: Robot) -> planner.PlanningProblem:
    """Make the planning problem of a plan request."""
    robot = mounted(with_tool(robot, request.tool), request.mounting)
    actions = to_actions(request.actions, request.waypoints)
    return planner.PlanningProblem(
        robot=robot,
        waypoints=with_waits(to_waypoints(request.waypoints, robot, request.frames), actions),
        limits=to_limits(request.limits),
        inverse_kinematics=to_options(request.ik, request.seed),
        payload=None if request.payload is None else to_payload(request.payload),
        duration=request.duration,
        start_tolerance=request.start_tolerance,
        actions=actions,
        scene=None if request.scene is None else to_scene(request.scene, frames_in_world(robot, request.frames)),
        self_collision=request.self_collision,
        speed_zones=to_speed_zones(request.speed_zones),
        residual_vibration=to_residual_vibration(request.residual_vibration),
        optimise=request.optimise,
        time_budget=request.time_budget,
        optimise_iterates=request.optimise_iterates,
        warm_start=None if request.warm_start is None else to_trajectory(request.warm_start, robot, ("warm_start",))[1],
    )


def to_residual_vibration(mode: common.VibrationMode | None) -> ResidualVibration | None:
    """Make a vibration mode."""
    return None if mode is None else ResidualVibration(**mode.model_dump())


def to_backend(asked: Any) -> BackEnd:
    """Make the back end of a plan request, with its options."""
    return BACKENDS[asked.kind](**asked.model_dump(exclude={"kind"}))


def to_waypoints(
    asked: Sequence[goal_sets.Waypoint], robot: Robot, frames: Mapping[str, common.Pose]
) -> tuple[planner.AnyWaypoint, ...]:
    """Make waypoints of any kind for a robot, whose named positions they may name, in frames that they may name.

    Raises:
        InvalidProblem: There is no position, or no frame, of a name.
    """
    taken = sorted(OWN_FRAMES & frames.keys())
    faults: list[tuple[FieldPath, str]] = [
        (("frames", name), "must have another name: this frame is predefined") for name in taken
    ]
    in_base = _frames_in_base(robot, frames)

    def convert(waypoint: waypoints.SingleWaypoint, path: FieldPath) -> planner.AnyWaypoint | None:
        frame = waypoint.frame or BASE if isinstance(waypoint, waypoints.PoseWaypoint) else BASE
        if frame not in in_base:
            faults.append(((*path, "frame"), _unknown_frame(frame, in_base, robot)))
            return None
        if isinstance(waypoint, waypoints.PoseWaypoint) and None not in (waypoint.on, waypoint.frame):
            faults.append(((*path, "frame"), "must be left out on an object"))
            return None
        force = waypoint.process_force
        if force is not None and (fault := _frame_fault(force, in_base, robot)):
            faults.append(((*path, "process_force", "frame"), fault))
            return None
        try:
            one = _to_waypoint(waypoint, robot, in_base[frame])
        except InvalidProblem as error:
            faults.extend(((*path, "name"), fault.message) for fault in error.faults)
            return None
        return one if force is None else replace(one, process_force=_to_process_force(force, in_base))

    made = [to_requested_waypoint(waypoint, ("waypoints", i), convert, faults) for i, waypoint in enumerate(asked)]
    if faults:
        raise InvalidProblem(faults)
    return tuple(one for one in made if one is not None)


def mounted(robot: Robot, mounting: common.Pose | None) -> Robot:
    """Mount a robot as requested, if at all."""
    if mounting is None:
        return robot
    if mounting.orientation is None:
        raise InvalidProblem([(("mounting", "orientation"), "must be given")])
    return robot.derived(mounting=to_pose(mounting))


def _frames_in_base(robot: Robot, frames: Mapping[str, common.Pose]) -> dict[str, Pose | None]:
    """Return the frames that waypoints may name, in the base frame; None: that itself.

    With a positioner, the base frame moves, and frames in the world have no fixed pose in it.
    """
    if robot.positioner:
        return {BASE: None}
    here = robot.mounting
    in_world = {WORLD: Pose(np.zeros(3), np.eye(3)), **{name: with_axes(to_pose(p)) for name, p in frames.items()}}
    return {BASE: None, **{name: pose if here is None else pose.to_frame(here) for name, pose in in_world.items()}}


def frames_in_world(robot: Robot, frames: Mapping[str, common.Pose]) -> dict[str, Pose]:
    """Return the frames that objects of a scene may name, in the world; the base frame moves with a positioner."""
    base = {} if robot.positioner else {BASE: robot.mounting or Pose(np.zeros(3), np.eye(3))}
    return {WORLD: Pose(np.zeros(3)), **base, **{name: to_pose(pose) for name, pose in frames.items()}}


def to_options(options: requests.InverseKinematicsOptions, seed: int) -> InverseKinematicsOptions:
    """Make the options by which poses are solved."""
    return InverseKinematicsOptions(
        tolerance_position=options.tolerance_position,
        tolerance_orientation=options.tolerance_orientation,
        reference=None if options.reference is None else tuple(options.reference),
        seed=seed,
        prefer=options.prefer,
    )


def with_tool(robot: Robot, tool: common.Pose | None) -> Robot:
    """Give a robot the requested tool, if any."""
    return robot if tool is None else robot.with_tool(to_pose(tool))


def with_process_force(robot: Robot, asked: common.ProcessForce | None) -> Robot:
    """Return a robot whose tool exerts the requested force, if any.

    Raises:
        InvalidProblem: There is no frame of that name.
    """
    if asked is None:
        return robot
    in_base = _frames_in_base(robot, {})
    if fault := _frame_fault(asked, in_base, robot):
        raise InvalidProblem([(("process_force", "frame"), fault)])
    return replace(robot, process_force=_to_process_force(asked, in_base))


def _frame_fault(asked: common.ProcessForce, in_base: Mapping[str, Pose | None], robot: Robot) -> str | None:
    """Return the fault of a process force in an unknown frame; None: it is known."""
    known = [TOOL, *in_base]
    return None if asked.frame in known else _unknown_frame(asked.frame, known, robot)


def _unknown_frame(name: str, known: Iterable[str], robot: Robot) -> str:
    """Return the message of a fault: there is no frame of that name that stands still in the base frame."""
    moves = ", for the base frame is the workpiece, which moves" if robot.positioner else ""
    return f"must be one of {', '.join(known)}{moves}; got {name!r}"


def _to_process_force(asked: common.ProcessForce, in_base: Mapping[str, Pose | None]) -> ProcessForce:
    """Make a process force, in the tool's axes or the base's."""
    (x, y, z), (a, b, c) = asked.force, asked.moment
    given = ProcessForce((x, y, z), (a, b, c), "tool" if asked.frame == TOOL else "base")
    frame = None if asked.frame == TOOL else in_base[asked.frame]
    return given if frame is None else given.from_frame(frame)


def to_payload(payload: common.Payload) -> Payload:
    """Make a payload."""
    x, y, z = payload.center_of_mass
    ixx, iyy, izz = payload.inertia
    a, b, c = payload.center_of_mass_tolerance
    tolerances = payload.mass_tolerance, (a, b, c), payload.inertia_tolerance
    return Payload(payload.mass, (x, y, z), (ixx, iyy, izz), *tolerances)


def to_limits(limits: common.Limits) -> Limits:
    """Make limits, lists as tuples."""
    asked = limits.model_dump()
    pairs = {name: value and list(map(tuple, value)) for name, value in asked.items() if name.endswith("_range")}
    return Limits(**with_tuples(asked | pairs))


def to_end_states(request: requests.ValidateRequest, joints: int) -> EndStates:
    """Make the motion before a trajectory and after it.

    Raises:
        InvalidProblem: There are more values than joints, or fewer.
    """

    def rates(name: str) -> FloatArray:
        values = getattr(request, name)
        return np.zeros(joints) if values is None else to_vector(values, joints, (name,))

    return EndStates(rates("initial_velocity"), rates("initial_acceleration"), rates("final_velocity"))


def to_vector(values: Sequence[float], length: int, field: FieldPath) -> FloatArray:
    """Make one value a joint an array (length,).

    Raises:
        InvalidProblem: There are more, or fewer.
    """
    if len(values) != length:
        raise InvalidProblem([(field, f"must have one value for each of the {length} joints; got {len(values)}")])
    return np.array(values, dtype=np.float64)


def _to_waypoint(waypoint: waypoints.SingleWaypoint, robot: Robot, frame: Pose | None) -> planner.AnyWaypoint:
    plain = ("name", "duration", "minimum_duration", "earliest_arrival", "latest_arrival", "dwell", "put_down")
    common_fields: dict[str, Any] = {name: getattr(waypoint, name) for name in plain} | {
        "motion": to_motion(waypoint.motion, frame),
        "transition": _to_transition(waypoint.transition),
        "limits": None if waypoint.limits is None else to_limits(waypoint.limits),
        "payload": None if waypoint.payload is None else to_payload(waypoint.payload),
        "attach": tuple(Attach(taken.id, taken.link, taken.touch_links) for taken in waypoint.attach),
        "detach": tuple(waypoint.detach),
        "tool": None if waypoint.tool is None else to_pose(waypoint.tool),
    }
    match waypoint:
        case waypoints.JointWaypoint():
            return planner.JointWaypoint(position=tuple(waypoint.position), **common_fields)
        case waypoints.NamedWaypoint():
            return planner.JointWaypoint.named(robot, waypoint.name, **common_fields)
        case waypoints.PoseWaypoint():
            asked = {} if waypoint.configuration is None else waypoint.configuration.model_dump()
            pose, named = to_pose(waypoint.pose), Configuration(**asked)
            common_fields["on"] = waypoint.on
            return planner.PoseWaypoint(pose, named, frame, _to_free(waypoint.free), waypoint.external, **common_fields)
        case waypoints.RelativeWaypoint():
            return planner.RelativeWaypoint(frame=waypoint.frame, move=_to_move(waypoint.move), **common_fields)


def _to_free(free: Literal["rotation_z"] | waypoints.Region | None) -> planner.Free | None:
    if not isinstance(free, waypoints.Region):
        return free
    ranges = {name: getattr(free, name) for name in waypoints.Region.model_fields}
    return planner.Region(**with_tuples(ranges))


def to_motion(motion: waypoints.Motion, frame: Pose | None) -> planner.Motion:
    """Make a motion, with its poses in a frame; None: the base frame."""

    def in_base(pose: common.Pose) -> Pose:
        return to_pose(pose) if frame is None else to_pose(pose).from_frame(frame)

    match motion:
        case waypoints.JointMotion():
            return planner.JointMotion(motion.turns)
        case free_motions.FreeMotion():
            keep = tuple(map(to_pose_constraint, motion.keep))
            return FreeMotion(**motion.model_dump(exclude={"kind", "keep"}), keep=keep)
        case waypoints.LinearMotion():
            return planner.LinearMotion(**_following(motion))
        case waypoints.CircularMotion():
            return planner.CircularMotion(in_base(motion.via), **_following(motion))
        case waypoints.PolylineMotion():
            return planner.PolylineMotion(tuple(map(in_base, motion.poses)), motion.blend, **_following(motion))
        case waypoints.SplineMotion():
            return planner.SplineMotion(tuple(map(in_base, motion.poses)), **_following(motion))


def _following(motion: waypoints.ToolMotion) -> dict[str, Any]:
    """Return the fields that say how closely the joints follow a motion of the tool."""
    fields = {name: getattr(motion, name) for name in waypoints.ToolMotion.model_fields}
    return fields | {"free": _to_free(motion.free)}


def _to_transition(transition: waypoints.Transition) -> planner.Transition:
    match transition:
        case waypoints.StopTransition():
            return planner.StopTransition()
        case waypoints.ThroughTransition():
            return planner.ThroughTransition(transition.velocity)
        case waypoints.BlendTransition():
            return planner.BlendTransition(transition.radius)


def _to_move(move: waypoints.Move) -> planner.Move:
    match move:
        case waypoints.CartesianMove():
            x, y, z = move.translation
            return planner.CartesianMove((x, y, z), to_rotation(move.orientation))
        case waypoints.CylindricalMove():
            return planner.CylindricalMove(move.r, move.alpha, move.l)
        case waypoints.SphericalMove():
            return planner.SphericalMove(move.r, move.beta, move.gamma)
