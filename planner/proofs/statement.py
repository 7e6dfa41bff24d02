"""The statement of a proof file: robot, limits, scene and waypoints in plain values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planner.certificate.clearance import segment_checkers
from planner.certificate.waypoints import certify_waypoints
from planner.constraints import VELOCITY_AT_POSITION
from planner.guarantees import end_states
from planner.proofs.checker import BOUNDED_CLAIMS, JOINT_CLAIMS, TOOL_CLAIMS
from planner.scene.arrays import core_of
from planner.scene.point_cloud import Cluster

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.constraints import Bounds
    from planner.limits import SegmentLimits
    from planner.plans.result import Plan
    from planner.robots import Robot
    from planner.scene.checker import CollisionChecker
    from planner.spatial import FloatArray

LIMITED = (*JOINT_CLAIMS, VELOCITY_AT_POSITION.name, *BOUNDED_CLAIMS)
"""The limited quantities that a proof can cover."""

OF_TORQUES = ("torque", "power", "total_power", "torque_at_speed")
"""The quantities that depend on torques; the checkers know no process force, friction and rotor inertia."""


def statement_of(plan: Plan) -> dict[str, Any]:
    """Write everything that a proof is about, without the trajectory."""
    path, problem = plan.path, plan.problem
    segments = max(1, len(path.limits.torque.upper))
    of_segments = [path.dynamics.robot_on(segment) for segment in range(segments)]
    robots = list(dict.fromkeys([*of_segments, *problem.robots]))
    kept = {check.quantity for check in plan.certificate.checks if check.enforced and check.limit is not None}
    claims = ["continuity", "waypoints", *(name for name in LIMITED if name in kept)]
    not_covered = sorted(kept - set(LIMITED) - {"waypoint_position_error", "waypoint_orientation_error"})
    regions = [problem.numbers[k] for k, waypoint in enumerate(problem.waypoints) if getattr(waypoint, "free", None)]
    not_covered += [f"waypoints: the tolerance region of waypoint {k} but for its nearest pose" for k in regions]
    if any(robot.process_force is not None for robot in of_segments):
        not_covered += [f"{name}: a process force acts" for name in claims if name in OF_TORQUES]
        claims = [name for name in claims if name not in OF_TORQUES]
    if any(joint.has_drive for joint in path.robot.joints):
        not_covered += [f"{name}: joints have friction or a rotor inertia" for name in claims if name in OF_TORQUES]
        claims = [name for name in claims if name not in OF_TORQUES]
    if path.robot.following_errors is not None:
        not_covered.append("following errors: the claims are about planned positions")
    if path.dynamics.changes:
        not_covered.append("torque at rest while the payload changes")
    if plan.certificate.speed_zones:
        not_covered.append("speed zones")
    scenes, scene_of_segment = _scenes(plan, segments)
    if plan.certificate.clearance is not None:
        has_clouds = any(isinstance(piece.shape, Cluster) for one in scenes for piece in one.obstacles.all)
        claims += [] if has_clouds else ["clearance"]
        not_covered += ["clearance: the scene has a point cloud"] if has_clouds else []
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
        "robots": [_robot(robot) for robot in robots],
        "robot_of_segment": [robots.index(robot) for robot in of_segments],
        "limits": _limits(path.robot, path.limits, claims),
        "continuity": max(0, int(plan.certificate.continuity[1:])),
        "ends": {"initial": ends_of("initial", 0.0), "final": ends_of("final", plan.trajectory.duration)},
        "waypoints": list(_waypoints(plan, robots)),
        "scenes": [_scene(checker) for checker in scenes] if "clearance" in claims else [],
        "scene_of_segment": scene_of_segment if "clearance" in claims else [],
    }


def motion_of(plan: Plan) -> dict[str, Any]:
    """Write the trajectory of a plan."""
    trajectory, last = plan.trajectory, max(1, len(plan.path.limits.torque.upper)) - 1
    return {
        "lengths": trajectory.lengths.tolist(),
        "coefficients": trajectory.coefficients.tolist(),
        "segments": np.minimum(trajectory.segments, last).tolist(),
    }


def _robot(robot: Robot) -> dict[str, Any]:
    """Return the kinematics and inertias of a robot with its payload and tool."""
    frame = robot.model.frames[robot.tool_frame_id]
    links = [
        {
            "rotation": row[:9].reshape(3, 3).tolist(),
            "origin": row[9:12].tolist(),
            "mass": float(row[12]),
            "center_of_mass": row[13:16].tolist(),
            "inertia": row[16:25].reshape(3, 3).tolist(),
            "motion": "revolute" if row[25] else "prismatic",
        }
        for row in robot.chain.links
    ]
    tool = {"joint": int(frame.parentJoint), "rotation": frame.placement.rotation.tolist()}
    tool["translation"] = frame.placement.translation.tolist()
    return {"links": links, "gravity": robot.chain.load[:3].tolist(), "tool": tool}


def finite(values: FloatArray) -> list[float | None]:
    """Return numbers with None in place of infinity."""
    return [value if np.isfinite(value) else None for value in values.tolist()]


def _limits(robot: Robot, limits: SegmentLimits, claims: Sequence[str]) -> dict[str, Any]:
    """Return the claimed limits of each segment; None: there is none."""
    segments, joints = limits.torque.upper.shape

    def rows(bounds: Bounds) -> list[list[list[float | None]]]:
        sides = (np.broadcast_to(side, (segments, joints)) for side in (bounds.lower, bounds.upper))
        return [[finite(lower), finite(upper)] for lower, upper in zip(*sides, strict=True)]

    found: dict[str, Any] = {name: rows(limits.bounds(name)) for name in (*JOINT_CLAIMS, "torque") if name in claims}
    found |= {name: finite(limits.of_tool[name]) for name in TOOL_CLAIMS if name in claims}
    for constraint, values in limits.further.items():
        if constraint.name in ("power", "total_power") and constraint.name in claims:
            found[constraint.name] = [finite(row) if constraint.of_joints else finite(row[None])[0] for row in values]
    if VELOCITY_AT_POSITION.name in claims:
        found[VELOCITY_AT_POSITION.name] = [list(_curves(robot, joint)) for joint in range(joints)]
        found["velocity_scale"] = limits.further[VELOCITY_AT_POSITION].tolist()
    return found


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


def _waypoints(plan: Plan, robots: Sequence[Robot]) -> Iterator[dict[str, Any]]:
    """Yield the waypoints with their times, and the joint positions and poses to be met there."""
    path, trajectory, problem = plan.path, plan.trajectory, plan.problem
    blended = {k for group in path.groups for k in group.blended}
    met = certify_waypoints(trajectory, problem, path.positions, blended)
    wanted = np.where(np.isnan(met.positions), path.positions, met.positions)
    for k, time in enumerate(trajectory.arrivals.tolist()):
        pose = None
        if met.targets and k not in blended and (target := met.targets[k]).tolerance != (0.0, 0.0):
            rotation = None if target.pose.rotation is None else target.pose.rotation.tolist()
            pose = {"position": target.pose.position.tolist(), "rotation": rotation}
            pose["tolerance"] = list(map(float, target.tolerance))
        position = None if k in blended else wanted[k].tolist()
        yield {"time": time, "robot": robots.index(problem.robots[k]), "position": position, "pose": pose}


def _scenes(plan: Plan, segments: int) -> tuple[list[CollisionChecker], list[int]]:
    """Return the collision checkers, and the index of the checker of each segment."""
    checkers = segment_checkers(plan.problem, plan.path.positions)
    distinct = list(dict.fromkeys(checkers))
    return distinct, [distinct.index(checkers[min(k, len(checkers) - 1)]) for k in range(segments)]


def pairs_of(checker: CollisionChecker) -> list[int]:
    """Return the numbers of all pairs that are checked."""
    return [*range(checker.own_pairs), *(np.flatnonzero(np.isfinite(checker.margins)) + checker.own_pairs).tolist()]


def _scene(checker: CollisionChecker) -> dict[str, Any]:
    """Return the shapes of a scene in the frames of their joints, and the pairs with their margins."""
    bodies, obstacles = checker.bodies.pieces, checker.obstacles
    placed = [(body, body.joint) for body in bodies] + [(obstacle, 0) for obstacle in obstacles.pieces]
    shapes = [{"name": piece.name, "joint": joint, **_shape(piece)} for piece, joint in placed]
    planes = zip(obstacles.half_spaces, obstacles.normals.tolist(), obstacles.offsets.tolist(), strict=True)
    shapes += [{"name": own.name, "joint": 0, "normal": normal, "offset": offset} for own, normal, offset in planes]
    numbers = np.array(pairs_of(checker), dtype=int)
    pairs = []
    for (one, other), margin in zip(
        checker.numbers_of(numbers).tolist(), checker.margins_of(numbers).tolist(), strict=True
    ):
        first, second = (one, other) if shapes[one]["joint"] <= shapes[other]["joint"] else (other, one)
        pairs.append([first, second, margin])
    return {"shapes": shapes, "pairs": pairs}


def _shape(piece: Any) -> dict[str, Any]:
    """Return a shape as points, and the disc and the ball that roll over their hull."""
    core = core_of(piece.shape)
    points = core.points @ piece.rotation.T + piece.translation
    return {
        "points": points.tolist(),
        "axis": piece.rotation[:, 2].tolist(),
        "disc": float(core.disc),
        "ball": float(core.ball),
    }
