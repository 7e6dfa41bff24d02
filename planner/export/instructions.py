"""Instructions of pendant programs: one motion for each waypoint, with its speeds, its blend and the rest after it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from planner.errors import UnsupportedFormat
from planner.export.programs import axes_first, moves, stops
from planner.guarantees import leaves_straight_motions
from planner.kinematics import FloatArray
from planner.kinematics.forward import tool_accelerations, tool_pose, tool_poses, tool_velocities
from planner.plans.result import Plan
from planner.problems import requested_indices
from planner.problems.actions import SetOutput
from planner.problems.problem import CartesianMotion, CircularMotion, JointMotion, LinearMotion, PolylineMotion
from planner.problems.transitions import BlendTransition, ThroughTransition
from planner.spatial import Pose
from planner.tool_motions.pose_paths import via_poses

SAMPLES_OF_SPEEDS = 200
"""Number of times of a segment at which its largest speeds are found."""

JOINT_POINT_STEP = 0.1
"""Largest travel of a joint between two joint points of a curve, rad."""

MAKERS = ("ABB", "FANUC", "KUKA", "Universal Robots", "Franka", "Kinova", "Yaskawa", "Staubli")
"""Makers with which the source of a catalogue's robot begins."""

DERIVED = re.compile(r"(derived from [^:]+: )+")
"""Beginning of the source of a derived robot; the source of the other robot follows."""


class Speeds(NamedTuple):
    """The largest speeds and accelerations of a certified segment.

    Attributes:
        joint: Share of the joints' limits of velocity: the largest of a joint, within every limit of the request.
        joint_acceleration: The same share of the limits of acceleration.
        leading: Speed of the fastest joint, rad/s.
        leading_acceleration: rad/s^2.
        linear: Speed of the tool, m/s.
        linear_acceleration: m/s^2.
        angular: rad/s.
        angular_acceleration: rad/s^2.
    """

    joint: float
    joint_acceleration: float
    leading: float
    leading_acceleration: float
    linear: float
    linear_acceleration: float
    angular: float
    angular_acceleration: float


@dataclass(frozen=True, eq=False)
class Instruction:
    """A motion of a program and the rest after it.

    Attributes:
        kind: `joint`, `line`, `circle`, or `points`: joint points of a curve that the language does not have.
        waypoint: Requested index of the waypoint that the motion leads to.
        segment: Index of the segment of the plan.
        position: (N, joints), degrees, as `axes_first` orders them; N is 1 but for `points`.
        poses: Poses of a motion of the tool in the base frame: the end, before it the point on a circle.
        speeds: The largest speeds of the certified segment.
        blend: Distance from the end at which the tool leaves its path, m; 0: it stops there, or passes a point.
        blend_share: That distance as a share of the shorter of the two adjacent motions; 1 is a whole motion.
        is_passed: Whether the motion goes on without a stop.
        tool: The tool that is set before the motion; None: unchanged.
        rest: Waits, s, and outputs after the motion, in their order.
    """

    kind: Literal["joint", "line", "circle", "points"]
    waypoint: int
    segment: int
    position: FloatArray
    poses: tuple[Pose, ...]
    speeds: Speeds
    blend: float = 0.0
    blend_share: float = 0.0
    is_passed: bool = False
    tool: Pose | None = None
    rest: tuple[float | SetOutput, ...] = ()


def _refuse_other_makers(plan: Plan, maker: str, language: str) -> None:
    """Refuse a program for an arm of the catalogue, or for one derived from it, that another maker builds.

    Raises:
        UnsupportedFormat: The arm is of another maker.
    """
    source = DERIVED.sub("", plan.path.robot.source)
    other = next((name for name in MAKERS if source.startswith(name)), maker)
    if other != maker:
        arm = f"{plan.path.robot.id} is an arm of {other}"
        raise UnsupportedFormat(f"{language} is the language of {maker}; {arm}. Choose a format of {other}.")


def instructions(
    plan: Plan, maker: str, language: str, period: float, *, has_fixed_tools: bool = False
) -> tuple[list[float | SetOutput], list[Instruction]]:
    """Turn a certified plan into the rest at its start and one instruction for each motion.

    A polyline is a line for each corner. Joint points stand for splines and for curves of the joints. They also stand
    for motions beside a waypoint passed `through`.

    Args:
        plan: The plan of an arm with six joints that turn.
        maker: The maker whose arms the language moves.
        language: The name of the language, for the refusal.
        period: A sample period that programs take, s.
        has_fixed_tools: Whether the language moves a workpiece that the arm holds under a fixed tool.

    Raises:
        UnsupportedFormat: The arm is another or of another maker, the trajectory begins or ends in motion, or an output
            is set in motion. Or the plan suppresses residual vibration, the tool is fixed, or objects of its scene
            move.
    """
    _refuse_other_makers(plan, maker, language)
    if plan.path.robot.holds_workpiece and not has_fixed_tools:
        raise UnsupportedFormat(
            f"{language} instructions move tools that the arm holds; {plan.path.robot.id} holds the workpiece under a "
            "fixed tool. Choose a format that has the time of every point."
        )
    scene = plan.problem.scene
    if scene is not None and scene.moving:
        raise UnsupportedFormat(
            f"{language} instructions leave the time scaling to the controller, which does not know where "
            f"{scene.moving[0].id!r} is. Choose a format that has the time of every point."
        )
    mode = plan.problem.residual_vibration
    if mode is not None and mode.suppress:
        raise UnsupportedFormat(
            f"{language} instructions leave the time scaling to the controller, which does not suppress residual "
            "vibration. Choose a format that has the time of every point."
        )
    rests = dict(zip(stops(plan, language), moves(plan, language, period), strict=True))
    moving = set(plan.path.moving.tolist())
    found: list[Instruction] = []
    before: list[float | SetOutput] = list(rests[0].steps_of_the_rest())
    tool = None
    for segment in range(len(plan.path.positions) - 1):
        tool = plan.problem.waypoints[segment + 1].tool or tool
        if segment in moving:
            found += [replace(each, tool=tool if i == 0 else None) for i, each in enumerate(_of_segment(plan, segment))]
            tool = None
        if segment + 1 in rests:
            steps = list(rests[segment + 1].steps_of_the_rest())
            if found:
                found[-1] = replace(found[-1], rest=(*found[-1].rest, *steps), blend=0.0, is_passed=False)
            else:
                before += steps
    return before, found


def _of_segment(plan: Plan, segment: int) -> Iterator[Instruction]:
    """Yield the instructions of a segment that moves."""
    waypoints, robot = plan.problem.waypoints, plan.problem.robots[segment + 1]
    motion = waypoints[segment + 1].motion
    number = requested_indices(plan.problem)[segment + 1]
    start, end = (tool_pose(robot, plan.path.positions[i]) for i in (segment, segment + 1))
    position = axes_first(plan.path.robot, plan.path.positions[[segment + 1]])
    speeds = _speeds(plan, segment)
    blend, share = _blend(plan, segment + 1)

    def to(kind: Literal["joint", "line", "circle"], *poses: Pose) -> Instruction:
        return Instruction(kind, number, segment, position, poses, speeds, blend, share, is_passed=blend > 0.0)

    if _is_curve(plan, segment):
        points = axes_first(plan.path.robot, _points(plan, segment))
        yield Instruction("points", number, segment, points, (), speeds, is_passed=True)
        return
    match motion:
        case LinearMotion():
            yield to("line", end)
        case CircularMotion():
            yield to("circle", _on_circle(plan, segment, motion.via), end)
        case PolylineMotion():
            via = via_poses(start, motion.poses, end)
            assert via.rotations is not None  # noqa: S101 - start and end have one
            for corner, rotation in zip(via.positions[1:-1], via.rotations[1:-1], strict=True):
                yield replace(to("line", Pose(corner, rotation)), blend=motion.blend, is_passed=motion.blend > 0.0)
            yield to("line", end)
        case _:
            yield to("joint", end)


def _is_curve(plan: Plan, segment: int) -> bool:
    """Tell whether the joints follow a curve that no instruction has."""
    waypoints = plan.problem.waypoints
    inner = [i for i in (segment, segment + 1) if 0 < i < len(waypoints) - 1]
    if any(isinstance(waypoints[i].transition, ThroughTransition) for i in inner):
        return True
    motion = waypoints[segment + 1].motion
    if isinstance(motion, JointMotion):
        return leaves_straight_motions(plan.backend)
    is_drawn = isinstance(motion, LinearMotion | CircularMotion | PolylineMotion)
    return not is_drawn or (isinstance(motion, CartesianMotion) and motion.free is not None)


def _times(plan: Plan, segment: int, count: int) -> FloatArray:
    """Return equally spaced times of a segment, its ends included."""
    return np.linspace(plan.trajectory.departures[segment], plan.trajectory.arrivals[segment + 1], count)


def _points(plan: Plan, segment: int) -> FloatArray:
    """Sample the joint positions of a segment, its start left out."""
    fine = plan.trajectory.evaluate(_times(plan, segment, SAMPLES_OF_SPEEDS), [0])[0]
    travel = float(np.abs(np.diff(fine, axis=0)).sum(axis=0).max())
    count = max(2, int(np.ceil(travel / JOINT_POINT_STEP)))
    return plan.trajectory.evaluate(_times(plan, segment, count + 1), [0])[0][1:]


def _speeds(plan: Plan, segment: int) -> Speeds:
    """Find the largest speeds of a segment among samples, which are at most the certified ones."""
    robot = plan.problem.robots[segment + 1]
    q, v, a = plan.trajectory.evaluate(_times(plan, segment, SAMPLES_OF_SPEEDS), [0, 1, 2])
    velocities, accelerations = tool_velocities(robot, q, v), tool_accelerations(robot, q, v, a)

    def share(quantity: Literal["velocity", "acceleration"], values: FloatArray) -> float:
        limit, bounds = robot.limit(quantity), getattr(plan.path.limits, quantity)
        enforced = np.minimum(bounds.upper[segment], -bounds.lower[segment])
        return float(min((np.abs(values).max(axis=0) / limit).max(), (enforced / limit).min(), 1.0))

    def largest(vectors: FloatArray) -> float:
        return float(np.linalg.norm(vectors, axis=1).max())

    return Speeds(
        share("velocity", v),
        share("acceleration", a),
        float(np.abs(v).max()),
        float(np.abs(a).max()),
        largest(velocities[0]),
        largest(accelerations[0]),
        largest(velocities[1]),
        largest(accelerations[1]),
    )


def _on_circle(plan: Plan, segment: int, via: Pose) -> Pose:
    """Return the point on a circle with the orientation of the tool nearest to it."""
    positions = plan.trajectory.evaluate(_times(plan, segment, SAMPLES_OF_SPEEDS), [0])[0]
    points, rotations = tool_poses(plan.problem.robots[segment + 1], positions)
    nearest = int(np.linalg.norm(points - via.position, axis=1).argmin())
    return Pose(via.position, rotations[nearest])


def _blend(plan: Plan, waypoint: int) -> tuple[float, float]:
    """Return the radius of the blend at a waypoint, m, and its share of the shorter adjacent joint motion."""
    transition = plan.problem.waypoints[waypoint].transition
    positions = plan.path.positions
    if not isinstance(transition, BlendTransition) or waypoint == len(positions) - 1:
        return 0.0, 0.0
    shares = []
    for other in (waypoint - 1, waypoint + 1):
        along = np.linspace(0.0, 1.0, SAMPLES_OF_SPEEDS)[:, None]
        joints = positions[waypoint] + along * (positions[other] - positions[waypoint])
        points, _ = tool_poses(plan.problem.robots[waypoint], joints)
        beyond = np.linalg.norm(points - points[0], axis=1) > transition.radius
        shares.append(float(along[beyond.argmax(), 0]) if beyond.any() else 1.0)
    return transition.radius, min(shares)
