"""The statement of a proof file: robot, limits, scene and waypoints in plain values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from planner.certificate.clearance import segment_checkers
from planner.certificate.lines_and_circles import Circle, Line
from planner.certificate.tool_path import nearest_poses, requested_paths
from planner.certificate.waypoints import MetWaypoints, certify_waypoints
from planner.constraints import (
    ACCELERATION_AT_SPEED,
    JERK_AT_SPEED,
    TORQUE_AT_SPEED,
    TORQUE_WITH_TOLERANCES,
    VELOCITY_AT_POSITION,
    Bounds,
)
from planner.constraints.at_speed import RateAtSpeed, TorqueAtSpeed
from planner.dynamics.torque_tolerances import INERTIAS
from planner.guarantees import end_states
from planner.plans.result import Plan
from planner.problems.motion_around import KeptMotion, as_requested
from planner.problems.problem import CartesianMotion, PoseWaypoint
from planner.problems.regions import region_of
from planner.problems.transitions import BlendTransition
from planner.proofs.checker import BOUNDED_CLAIMS, DISTANCE_CLAIMS, JOINT_CLAIMS, TOOL_CLAIMS
from planner.proofs.conditions import Condition, conditions_at, conditions_in, conditions_of, squared_tolerance
from planner.proofs.guides import guide_of
from planner.proofs.moving_workpieces import in_chain, left_out
from planner.proofs.polynomial_paths import PolynomialPath
from planner.robots import Robot
from planner.robots.varying.torque_curves import TorqueCurves
from planner.scene.arrays import core_of
from planner.scene.checker import CollisionChecker
from planner.scene.point_cloud import Cluster
from planner.spatial import FloatArray, Pose
from planner.speed_zones import SpeedZone
from planner.tool_motions.polylines import Polyline
from planner.tool_motions.pose_splines import PoseSpline

LIMITED = (*JOINT_CLAIMS, VELOCITY_AT_POSITION.name, *BOUNDED_CLAIMS)
"""The limited quantities that a proof can cover."""

AT_SPEED = (TORQUE_AT_SPEED, ACCELERATION_AT_SPEED, JERK_AT_SPEED)
"""The constraints whose limits depend on the speed of a joint."""

PLANNED = ("waypoints", "path_deviation", "tool_pose", "speed_zones")
"""The claims that hold for planned positions, whatever the following errors are."""

OF_WAYPOINTS = {
    "waypoint_position_error",
    "waypoint_orientation_error",
    "blend_deviation",
    "path_position_deviation",
    "path_orientation_deviation",
}
"""The quantities that the claims `waypoints` and `path_deviation` have."""


def statement_of(plan: Plan, *, follows: bool) -> dict[str, Any]:
    """Write everything that a proof is about, without the trajectory.

    Args:
        plan: The plan.
        follows: Whether limits of torque and tool are to hold at all positions within the robot's following errors.
    """
    path, problem = plan.path, plan.problem
    segments = max(1, len(path.limits.torque.upper))
    of_segments = [path.dynamics.robot_on(segment) for segment in range(segments)]
    robots = list(dict.fromkeys([*of_segments, *problem.robots]))
    met = met_waypoints(plan)
    kept = {check.quantity for check in plan.certificate.checks if check.enforced and check.limit is not None}
    claims = ["continuity", "waypoints", *(name for name in LIMITED if name in kept)]
    conditions, of_pose = _kept_poses(plan, segments)
    claims += ["tool_pose"] if any(conditions) else []
    is_given = not any(robot.uncertain_payloads or robot.friction_tolerance is not None for robot in robots)
    of_tube = {TORQUE_WITH_TOLERANCES.name} if follows and is_given and not path.robot.positioner else set()
    not_covered = sorted(kept - set(LIMITED) - OF_WAYPOINTS - of_pose - of_tube)
    guides, of_paths = _guides(plan, met)
    not_covered += of_paths
    claims += ["path_deviation"] if guides else []
    in_regions = {k: _in_region(plan, met, k) for k in range(len(problem.waypoints))}
    regions = [problem.numbers[k] for k, conditions in in_regions.items() if conditions == []]
    not_covered += [f"waypoints: the tolerance region of waypoint {k} but for its nearest pose" for k in regions]
    if path.dynamics.changes:
        not_covered.append("torque at rest while the payload or the process force changes")
    scenes, scene_of_segment = _scenes(plan, segments)
    has_clouds = any(isinstance(piece.shape, Cluster) for one in scenes for piece in one.obstacles.all)
    reasons = ["the scene has a point cloud"] if has_clouds else []
    reasons += ["objects of the scene move"] if any(one.moving for one in scenes) else []
    limited = {name for one in scenes for name, pairs in pairs_of(one, problem.speed_zones).items() if pairs}
    distances = [name for name in DISTANCE_CLAIMS if getattr(plan.certificate, name) and name in limited]
    claims += [] if reasons else distances
    not_covered += [f"{name}: {reason}" for name in distances for reason in reasons]
    lost = left_out(path.robot, scenes)
    not_covered += [f"{name}: {reason}" for name, reason in lost.items() if name in claims]
    claims = [name for name in claims if name not in lost]
    if path.robot.following_errors is not None:
        planned = ", ".join(name for name in PLANNED if name in claims) if follows else "all claims"
        not_covered.append(f"following errors: {planned} hold for planned positions")
        if "clearance" in claims:
            not_covered.append("following errors: the margins of clearance contain displacements that are not proved")
    ends, still = end_states(plan.backend, path.robot.dof), np.zeros(path.robot.dof)

    def ends_of(name: str, time: float) -> list[list[float]]:
        """Return the position at an end, and the first four derivatives before or after."""
        moving = (np.broadcast_to(getattr(ends, f"{name}_{of}"), still.shape) for of in ("velocity", "acceleration"))
        return [values.tolist() for values in (plan.trajectory.evaluate(time, [0])[0], *moving, still, still)]

    return {
        "robot": path.robot.id,
        "joint_names": list(path.robot.joint_names),
        "claims": claims,
        "not_covered": not_covered,
        "segments": segments,
        "robots": [_robot(robot, follows) for robot in robots],
        "robot_of_segment": [robots.index(robot) for robot in of_segments],
        "limits": _limits(plan, claims, of_segments, follows)
        | ({"path_deviation": [guides.get(segment) for segment in range(segments)]} if guides else {})
        | ({"tool_pose": conditions} if any(conditions) else {}),
        "continuity": max(0, int(plan.certificate.continuity[1:])),
        "ends": {"initial": ends_of("initial", 0.0), "final": ends_of("final", plan.trajectory.duration)},
        "waypoints": list(_waypoints(plan, met, robots)),
        "scenes": [_scene(path.robot, own, problem.speed_zones) for own in scenes] if {*claims} & {*distances} else [],
        "scene_of_segment": scene_of_segment if {*claims} & {*distances} else [],
    }


def motion_of(plan: Plan) -> dict[str, Any]:
    """Write the trajectory of a plan."""
    trajectory, last = plan.trajectory, max(1, len(plan.path.limits.torque.upper)) - 1
    return {
        "lengths": trajectory.lengths.tolist(),
        "coefficients": trajectory.coefficients.tolist(),
        "segments": np.minimum(trajectory.segments, last).tolist(),
    }


def _robot(robot: Robot, follows: bool) -> dict[str, Any]:
    """Return the kinematics and inertias of a robot with its payload and tool, and its following errors.

    Where the workpiece moves, no claim is about torques, and the masses are 0.
    """
    frame, rows = robot.model.frames[robot.tool_frame_id], robot.chain.links.copy()
    if robot.positioner:
        rows[:, INERTIAS] = 0.0
    links = [
        {
            "rotation": row[:9].reshape(3, 3).tolist(),
            "origin": row[9:12].tolist(),
            "mass": float(row[12]),
            "center_of_mass": row[13:16].tolist(),
            "inertia": row[16:25].reshape(3, 3).tolist(),
            "motion": "revolute" if row[25] else "prismatic",
            "friction": joint.friction,
            "damping": joint.damping,
            "rotor_inertia": joint.rotor_inertia,
        }
        for row, joint in zip(rows, robot.joints, strict=True)
    ]
    tool = {"joint": int(frame.parentJoint), "rotation": frame.placement.rotation.tolist()}
    tool["translation"] = frame.placement.translation.tolist()
    force, moment, start = [0.0] * 3, [0.0] * 3, tool["joint"]
    if robot.process_force is not None:
        numbers = robot.process_force.on_chain(frame).tolist()
        force, moment, start = numbers[:3], numbers[3:6], 0 if numbers[-1] else tool["joint"]
    return {
        "links": links,
        "gravity": robot.chain.load[:3].tolist(),
        "tool": tool,
        "process_force": [start, force, moment],
        "following_errors": [joint.following_error if follows else 0.0 for joint in robot.joints],
    }


def finite(values: FloatArray) -> list[float | None]:
    """Return numbers with None in place of infinity."""
    return [value if np.isfinite(value) else None for value in values.tolist()]


def _limits(plan: Plan, claims: Sequence[str], robots: Sequence[Robot], follows: bool) -> dict[str, Any]:
    """Return the claimed limits of each segment with its robot; None: there is none."""
    robot, limits = plan.path.robot, plan.path.limits
    segments, joints = limits.torque.upper.shape

    def rows(bounds: Bounds) -> list[list[list[float | None]]]:
        sides = (np.broadcast_to(side, (segments, joints)) for side in (bounds.lower, bounds.upper))
        return [[finite(lower), finite(upper)] for lower, upper in zip(*sides, strict=True)]

    found: dict[str, Any] = {name: rows(limits.bounds(name)) for name in (*JOINT_CLAIMS, "torque") if name in claims}
    if "torque" in claims and follows and robot.following_errors is not None:
        found["torque"] = rows(Bounds.of_magnitudes(limits.torque.narrower))
    found |= {name: finite(limits.of_tool[name]) for name in TOOL_CLAIMS if name in claims}
    for constraint, values in limits.further.items():
        if constraint.name in ("power", "total_power") and constraint.name in claims:
            found[constraint.name] = [[finite(-np.atleast_1d(row)), finite(np.atleast_1d(row))] for row in values]
    for constraint in (own for own in AT_SPEED if own.name in claims):
        shares = limits.further[constraint].tolist()
        found[constraint.name] = [
            list(_lines(_curves_by_speed(robot, constraint), share, joints))
            for robot, share in zip(robots, shares, strict=True)
        ]
    if VELOCITY_AT_POSITION.name in claims:
        found[VELOCITY_AT_POSITION.name] = [list(_curves(robot, joint)) for joint in range(joints)]
        found["velocity_scale"] = limits.further[VELOCITY_AT_POSITION].tolist()
    return found


def _curves_by_speed(robot: Robot, constraint: TorqueAtSpeed | RateAtSpeed) -> TorqueCurves | None:
    return constraint.curves_of(robot) if isinstance(constraint, RateAtSpeed) else robot.torque_curves


def _lines(curves: TorqueCurves | None, share: float, joints: int) -> Iterator[list[list[float | None]]]:
    """Yield the lines of each joint: first and last speed, limit at the first one, and descent by speed."""
    for joint in range(joints):
        if curves is None:
            yield []
            continue
        arrays = (curves.speed, curves.ends, share * curves.torque, share * curves.slope)
        rows = np.stack([array[joint] for array in arrays], axis=1)
        yield [finite(row) for row in rows if np.isfinite(row[0]) and np.isfinite(row[2])]


def _curves(robot: Robot, joint: int) -> Iterator[dict[str, Any]]:
    """Yield the velocity limits of a joint that depend on its position."""
    conditions = robot.velocity_conditions
    if conditions is None:
        return
    for side, towards in enumerate(("upper", "lower")):
        for numbers in zip(*(array[side, joint].tolist() for array in conditions.arrays), strict=True):
            *coefficients, low, high = numbers
            if low <= high:
                ends = {"low": low if np.isfinite(low) else None, "high": high if np.isfinite(high) else None}
                yield {"towards": towards, "coefficients": coefficients, **ends}


def met_waypoints(plan: Plan) -> MetWaypoints:
    """Compare the waypoints of a plan with its trajectory."""
    return certify_waypoints(plan.trajectory, plan.problem, plan.path.positions, _blended(plan))


def _blended(plan: Plan) -> set[int]:
    return {k for group in plan.path.groups for k in group.blended}


def paths_of(plan: Plan, met: MetWaypoints) -> dict[int, Line | Circle | PolynomialPath | None]:
    """Return the path of the tool by segment; None: it is no path for proofs."""
    problem, moving = plan.problem, set(plan.trajectory.segments.tolist())
    found: dict[int, Line | Circle | PolynomialPath | None] = {}
    for k, path in requested_paths(problem.robots, problem.waypoints, plan.path.waypoints, met.targets).items():
        requested, tools = problem.waypoints[k + 1].motion, (plan.path.dynamics.robot_on(k), problem.robots[k + 1])
        one, other = (robot.tool_in_tip.homogeneous for robot in tools)
        if k not in moving:
            continue
        found[k], motion = None, plan.path.waypoints[k + 1].tool_motion
        if not isinstance(requested, CartesianMotion) or (one != other).any():
            continue
        if not requested.free:
            found[k] = path_of(path)
        elif motion is not None:
            poses = partial(nearest_poses, region_of(requested.free), path, motion.curve, tools[0])
            found[k] = PolynomialPath.of(poses, motion.curve.breakpoints)
    return found


def path_of(path: Line | Circle | Polyline | PoseSpline) -> Line | Circle | PolynomialPath | None:
    """Return a line or a circle with a guide, or the parts of a path; None: there are too many."""
    match path:
        case Polyline():
            return PolynomialPath.of(path.poses, path.breakpoints)
        case PoseSpline():
            return PolynomialPath.of(path.poses_on_curve, path.curve.breakpoints)
    return path if guide_of(path) else PolynomialPath.of(path.poses, np.array([0.0, 1.0]))


def _guides(plan: Plan, met: MetWaypoints) -> tuple[dict[int, dict[str, Any]], list[str]]:
    """Return the guides of segments, and the parts of their paths that a proof does not cover."""
    found, left_out = {}, []
    for k, path in paths_of(plan, met).items():
        motion = plan.problem.waypoints[k + 1].motion
        assert isinstance(motion, CartesianMotion)  # noqa: S101 - others have no path
        if path is None:
            left_out.append(f"path_deviation: the path of segment {k} has too many parts")
            continue
        if isinstance(path, PolynomialPath):
            followed = "poses in the tolerance region" if motion.free else "the path"
            within = "within 1e-9 m and rad, as compared at points"
            left_out.append(f"path_deviation: polynomials follow {followed} of segment {k} {within}")
            guides, starts = path.guides, path.starts
        else:
            guides, starts = [guide for guide in [guide_of(path)] if guide], path.start
        allowed = [motion.tolerance_position, *([] if starts is None else [motion.tolerance_orientation])]
        found[k] = {
            "guides": guides,
            "tolerance": squared_tolerance(allowed),
            "blends": [ball for end in (k, k + 1) if (ball := _blend(plan, met, end)) is not None],
        }
    return found, left_out


def _blend(plan: Plan, met: MetWaypoints, k: int) -> Condition | None:
    """Return the condition of the blend of a waypoint; None: the robot does not leave its path there."""
    transition = plan.problem.waypoints[k].transition
    if not isinstance(transition, BlendTransition):
        return None
    return conditions_at(Pose(met.targets[k].pose.position), [transition.radius])[0]


def _kept_poses(plan: Plan, segments: int) -> tuple[list[list[Condition]], set[str]]:
    """Return the conditions to be kept on each segment, and the quantities that they limit."""
    found: list[list[Condition]] = [[] for _ in range(segments)]
    covered, left = set[str](), set[str]()
    for own, waypoint in zip(found, plan.problem.waypoints[1 : segments + 1], strict=False):
        for kept in waypoint.motion.keep if isinstance(waypoint.motion, KeptMotion) else ():
            conditions = conditions_of(kept)
            (left if conditions is None else covered).add(kept.quantity)
            own += conditions or []
    return found, covered - left


def _waypoints(plan: Plan, met: MetWaypoints, robots: Sequence[Robot]) -> Iterator[dict[str, Any]]:
    """Yield the waypoints with their times, and the joint positions and poses to be met there."""
    path, trajectory, problem, blended = plan.path, plan.trajectory, plan.problem, _blended(plan)
    wanted = np.where(np.isnan(met.positions), path.positions, met.positions)
    for k, time in enumerate(trajectory.arrivals.tolist()):
        conditions = _in_region(plan, met, k) or []
        if not conditions and met.targets and k not in blended and (target := met.targets[k]).tolerance != (0.0, 0.0):
            conditions = conditions_at(target.pose, target.tolerance)
        if met.targets and k in blended and (ball := _blend(plan, met, k)) is not None:
            conditions = [ball]
        position = None if k in blended else wanted[k].tolist()
        yield {"time": time, "robot": robots.index(problem.robots[k]), "position": position, "tool_pose": conditions}


def _in_region(plan: Plan, met: MetWaypoints, k: int) -> list[Condition] | None:
    """Return the conditions of a waypoint's tolerance region; empty: they cannot describe it; None: it has none."""
    waypoint = as_requested(plan.problem.waypoints[k])
    if not isinstance(waypoint, PoseWaypoint) or not waypoint.free:
        return None
    if k in _blended(plan):
        return []
    return conditions_in(region_of(waypoint.free), waypoint.pose_in_base, met.targets[k].tolerance) or []


def _scenes(plan: Plan, segments: int) -> tuple[list[CollisionChecker], list[int]]:
    """Return the collision checkers, and the index of the checker of each segment."""
    checkers = segment_checkers(plan.problem, plan.path.positions)
    distinct = list(dict.fromkeys(checkers))
    return distinct, [distinct.index(checkers[min(k, len(checkers) - 1)]) for k in range(segments)]


def pairs_of(checker: CollisionChecker, zones: Sequence[SpeedZone]) -> dict[str, list[tuple[int, list[float]]]]:
    """Return the pairs of each claim about distances: their numbers, and their margins or clearance and speed."""
    among = np.flatnonzero(np.isfinite(checker.margins)) + checker.own_pairs
    numbers = np.concatenate([np.arange(checker.own_pairs), among])
    margins = [[margin] for margin in checker.margins_of(numbers).tolist()]
    objects = [obstacle.name for obstacle in checker.obstacles.all]
    of_zones = [
        (number, [zone.clearance, zone.speed])
        for zone in zones
        for number in among.tolist()
        if zone.objects is None or objects[(number - checker.own_pairs) % len(objects)] in zone.objects
    ]
    return {"clearance": list(zip(numbers.tolist(), margins, strict=True)), "speed_zones": of_zones}


def _scene(robot: Robot, checker: CollisionChecker, zones: Sequence[SpeedZone]) -> dict[str, Any]:
    """Return the shapes of a scene in the frames of their joints, and the pairs of each claim about distances."""
    bodies, obstacles = checker.bodies.pieces, checker.obstacles
    placed = [(body, body.joint) for body in bodies] + [(obstacle, 0) for obstacle in obstacles.pieces]
    shapes = [{"name": piece.name, **_shape(robot, piece, joint)} for piece, joint in placed]
    planes = zip(obstacles.half_spaces, obstacles.normals.tolist(), obstacles.offsets.tolist(), strict=True)
    shapes += [{"name": own.name, "joint": 0, "normal": normal, "offset": offset} for own, normal, offset in planes]
    joints = [shape["joint"] for shape in shapes]
    found: dict[str, Any] = {"shapes": shapes}
    for name, rows in pairs_of(checker, zones).items():
        both = checker.numbers_of(np.array([number for number, _ in rows], dtype=int)).tolist()
        found[name] = [
            [*sorted(pair, key=joints.__getitem__), *limits] for pair, (_, limits) in zip(both, rows, strict=True)
        ]
    return found


def _shape(robot: Robot, piece: Any, joint: int) -> dict[str, Any]:
    """Return a shape behind a joint as points, and the disc and the ball that roll over their hull."""
    core = core_of(piece.shape)
    number, rotation, translation = in_chain(robot, joint, piece.rotation, piece.translation)
    points = core.points @ rotation.T + translation
    return {
        "joint": number,
        "points": points.tolist(),
        "axis": rotation[:, 2].tolist(),
        "disc": float(core.disc),
        "ball": float(core.ball),
    }
