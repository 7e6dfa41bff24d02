"""What would help where a motion of the tool cannot be followed; finding it costs some milliseconds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from planner.errors import ConfigurationChange, Remedy, SingularPath, UnreachableWaypoint
from planner.kinematics.configurations import configurations
from planner.kinematics.forward import tool_pose
from planner.kinematics.inverse import all_solutions
from planner.problems.motion_around import as_requested
from planner.problems.problem import AnyWaypoint, JointMotion, JointWaypoint, PoseWaypoint, Singularity
from planner.spatial import FloatArray
from planner.tolerances import SAME_CONFIGURATION
from planner.tool_motions.pose_paths import Line
from planner.tool_motions.tool_motion import RefusedMotion, ToolMotion, follow_path
from planner.waypoints.targets import pose_remedy

SHORTENED = 0.98
"""Share of the way to the point where a line fails that the remedy of a moved pose keeps."""


NEAR_SINGULARITY: dict[Singularity, str] = {
    "slow": "the tool keeps to its path, slowly near the singularity",
    "deviate": "the tool turns off by less than the tolerance, and the arm goes right through the singularity",
}
"""Alternative behaviours of a motion near a singularity, and their effect."""


def motion_remedies(refused: RefusedMotion, before: AnyWaypoint) -> Iterator[Remedy]:
    """Return changes after which a motion from the waypoint `before` can be done."""
    requested, point = refused.requested, refused.point
    waypoint, before = as_requested(requested.waypoint), as_requested(before)
    index, is_change = requested.index, isinstance(refused.error, ConfigurationChange)
    if is_change and isinstance(waypoint, PoseWaypoint):
        (ends,) = configurations(requested.robot, point.position[None])
        names = ends.of_parts(requested.configuration.names)
        yield Remedy(("waypoints", index, "configuration"), names, "the configuration in which the motion ends")
    elif is_change and isinstance(waypoint, JointWaypoint) and not _is_named(waypoint):
        position = tuple(point.position.tolist())
        yield Remedy(("waypoints", index, "position"), position, "the joint position in which the motion ends")
    elif (
        isinstance(before, JointWaypoint)
        and not _is_named(before)
        and (index == 1 or isinstance(before.motion, JointMotion))
    ):
        is_out_of_reach = isinstance(refused.error, UnreachableWaypoint)  # from wherever the motion starts
        other = None if is_out_of_reach else _other_start(refused)
        if other is not None:
            explanation = "the same pose in another configuration, from which the motion can be done"
            yield Remedy(("waypoints", index - 1, "position"), tuple(other.tolist()), explanation)
    if isinstance(refused.error, SingularPath):
        yield from _near_singularity(refused)
    yield Remedy(("waypoints", index, "motion"), JointMotion(), "a joint motion to the same waypoint")
    kept = SHORTENED * point.fraction
    if not isinstance(refused.path, Line) or kept < 1.0 - SHORTENED or is_change:
        return
    explanation = f"the first {kept:.1%} of the line"
    start = refused.path.pose(0.0)
    yield from pose_remedy(index, requested.waypoint, refused.path.pose(kept), start, start.rotation, explanation)


def _is_named(waypoint: AnyWaypoint) -> bool:
    """Tell whether the waypoint is a named position of the robot, which is fixed."""
    return isinstance(waypoint, JointWaypoint) and waypoint.position_name is not None


def _near_singularity(refused: RefusedMotion) -> Iterator[Remedy]:
    """Yield the behaviours near a singularity that let the joints follow a motion."""
    requested = refused.requested
    for choice, explanation in NEAR_SINGULARITY.items():
        waypoint = replace(requested.waypoint, motion=replace(requested.motion, singularity=choice))
        if isinstance(follow_path(replace(requested, waypoint=waypoint), refused.start, refused.path), ToolMotion):
            yield Remedy(("waypoints", requested.index, "motion", "singularity"), choice, explanation)


def _other_start(refused: RefusedMotion) -> FloatArray | None:
    """Find another joint position at the pose before from which the joints can follow the motion."""
    requested, start = refused.requested, refused.start
    pose = tool_pose(requested.robot, start)
    for other in all_solutions(requested.robot, pose, requested.options, start):
        if np.abs(other - start).max() > SAME_CONFIGURATION:
            followed = follow_path(requested, other, refused.path)
            if isinstance(followed, ToolMotion):
                return other
    return None
