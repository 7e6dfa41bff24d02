"""The judge of goals and curves: plans reach the requested goals, times and speeds along the requested paths."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from tests.api.random_requests.answered import Answered, segments, times_of
from tests.api.random_requests.poses import angles_of, in_base, placement, thing_at, tool_at

if TYPE_CHECKING:
    from planner.robots import Robot
    from tests.api.random_requests.answered import Segment

ON_CURVE = 40
"""Number of times at which the tool is checked against a curve."""


def goals_hold(robot: Robot, request: dict[str, Any], answer: dict[str, Any]) -> None:
    """Fail where a plan differs from its request; the robot is mounted as in the request."""
    trajectory, times = Answered(answer["polynomials"]), times_of(answer)
    _continuous(trajectory, request)
    if request.get("duration"):
        assert abs(answer["duration"] - request["duration"]) <= 1e-6 * request["duration"], "duration of the whole"
    waypoints = request["waypoints"]
    for segment in segments(request, answer):
        k = segment.index
        assert k is not None
        asked, row, before = waypoints[k], times[k], times[k - 1]
        takes = segment.last - segment.first
        moves = np.abs(np.subtract(row["position"], before["position"])).max() > 1e-8
        if asked.get("duration") and moves:
            assert abs(takes - asked["duration"]) <= 1e-6 * (1.0 + asked["duration"]), f"duration {k}"
        if asked.get("minimum_duration") and moves:
            assert takes >= asked["minimum_duration"] - 1e-6, f"minimum duration {k}"
        assert row["departure_time"] - row["arrival_time"] >= asked.get("dwell", 0.0) - 1e-9, f"dwell {k}"
        assert row["arrival_time"] >= asked.get("earliest_arrival", 0.0) - 1e-6, f"waypoint {k} is reached too early"
        assert row["arrival_time"] <= (asked.get("latest_arrival") or np.inf) + 1e-6, (
            f"waypoint {k} is reached too late"
        )
        if asked.get("on"):
            _moves_along(robot, request, segment, trajectory, times)
        passage = asked.get("transition", {"kind": "stop"})
        if passage["kind"] != "blend":
            here, velocity = trajectory.at(np.array([row["arrival_time"]]), 2)
            assert np.abs(here[0] - row["position"]).max() <= 1e-6, f"waypoint {k} is not passed"
            if passage.get("velocity") and moves:
                assert np.abs(velocity[0] - passage["velocity"]).max() <= 1e-6, f"velocity {k}"
        else:
            _cuts_within(robot, request, answer, k, segment.tool)
        _arrives(robot, request, k, segment.tool, times)
        if k > 0 and moves and _stops(waypoints, k - 1) and _stops(waypoints, k):
            _keeps_to_curve(robot, request, segment, trajectory, times)


def _cuts_within(
    robot: Robot, request: dict[str, Any], answer: dict[str, Any], k: int, tool: dict[str, Any] | None
) -> None:
    """Check the tool amid a blend against its radius, which a warning may state as reduced."""
    radius, row = request["waypoints"][k]["transition"]["radius"], times_of(answer)[k]
    for warning in answer["warnings"]:
        said = re.match(rf"waypoint {k} is blended within (\S+) m in place of (\S+) m, ", warning["message"])
        if said:
            assert warning["code"] == "blend_reduced"
            taken, asked = map(float, said.groups())
            assert abs(asked - radius) <= 1e-5 * radius, "another radius was asked"
            assert radius / 32.0 * (1.0 - 1e-5) <= taken < radius
            radius = taken
    here = Answered(answer["polynomials"]).at(np.array([row["arrival_time"]]))[0][0]
    corner, middle = (tool_at(robot, np.array(position), tool).translation for position in (row["position"], here))
    assert np.linalg.norm(middle - corner) <= radius * (1.0 + 1e-5) + 1e-6, f"the blend at waypoint {k} is too large"


def _stops(waypoints: list[dict[str, Any]], k: int) -> bool:
    return k in (0, len(waypoints) - 1) or waypoints[k].get("transition", {"kind": "stop"})["kind"] == "stop"


def _continuous(trajectory: Answered, request: dict[str, Any]) -> None:
    """Check that positions and velocities do not jump, and that both ends rest unless requested otherwise."""
    lengths, count = np.diff(trajectory.breakpoints), len(trajectory.coefficients)
    ends = trajectory.derivatives(np.arange(count), lengths, 2)
    starts = trajectory.derivatives(np.arange(count), np.zeros(count), 2)
    for end, start in zip(ends, starts, strict=True):
        assert np.abs(end[:-1] - start[1:]).max(initial=0.0) <= 1e-6, "it jumps"
    for name, found in (("initial_velocity", starts[1][0]), ("final_velocity", ends[1][-1])):
        requested = request["backend"].get(name) or np.zeros_like(found)
        assert np.abs(found - requested).max() <= 1e-6, name


def _arrives(
    robot: Robot, request: dict[str, Any], k: int, tool: dict[str, Any] | None, times: dict[int, dict[str, Any]]
) -> None:
    """Check the joint position of a waypoint against the request there."""
    asked, joint_position = request["waypoints"][k], np.array(times[k]["position"])
    if asked["kind"] in ("joint", "named"):
        wanted = asked["position"] if asked["kind"] == "joint" else robot.named_positions[asked["name"]]
        off = joint_position - np.array(wanted)
        off = np.where(robot.is_continuous, np.abs(np.mod(off + np.pi, 2.0 * np.pi) - np.pi), np.abs(off))
        inside = np.clip(wanted, robot.limit("lower"), robot.limit("upper")) == np.array(wanted)
        assert (off <= np.where(inside, 1e-6, 1.1e-4)).all(), f"waypoint {k} is another one"
        return
    reached = tool_at(robot, joint_position, tool)
    ik = request.get("ik") or {}
    near = ik.get("tolerance_position", 1e-6) * 1.01 + 1e-9
    aligned = ik.get("tolerance_orientation", 1e-6) * 1.01 + 1e-8
    if asked["kind"] == "relative":
        start = tool_at(robot, np.array(times[k - 1]["position"]), tool)
        off = _moved(start, asked).actInv(reached)
        assert np.linalg.norm(off.translation) <= near, f"the move to waypoint {k}: {off.translation}"
        turned = np.linalg.norm(pin.log3(off.rotation))
        assert turned <= aligned or _is_turn_open(robot, request["waypoints"], k), f"the turn to waypoint {k}: {turned}"
        return
    for name, position in (asked.get("external") or {}).items():
        assert abs(joint_position[robot.joint_names.index(name)] - position) <= 1e-6, f"{name} at waypoint {k}"
    pose = asked["pose"]
    goal = in_base(robot, request, asked.get("frame")) * placement(pose)
    if asked.get("on"):
        (thing,) = (thing for thing in request["scene"]["objects"] if thing["id"] == asked["on"])
        goal = thing_at(robot, request, thing, times[k]["arrival_time"]) * placement(pose)
        near, aligned = 1e-4, 1e-3
    if pose.get("orientation") is None:
        assert np.linalg.norm(reached.translation - goal.translation) <= near, f"position of waypoint {k}"
        return
    off_goal = goal.actInv(reached)
    free = asked.get("free") or {}
    free = {"rotation_z": [-np.pi, np.pi]} if free == "rotation_z" else free
    offsets = [*off_goal.translation, *angles_of(Rotation.from_matrix(off_goal.rotation), "XYZ")]
    names = ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z")
    for name, offset in zip(names, offsets, strict=True):
        least, most = free.get(name) or (0.0, 0.0)
        loose = near if len(name) == 1 else aligned
        assert least - loose <= offset <= most + loose, f"{name} of waypoint {k}: {offset}"


def _is_turn_open(robot: Robot, waypoints: list[dict[str, Any]], k: int) -> bool:
    """Tell whether a relative waypoint, or its last non-relative predecessor, requests a position only."""
    while waypoints[k]["kind"] == "relative":
        k -= 1
    return robot.is_position_only or (waypoints[k]["kind"] == "pose" and not waypoints[k]["pose"].get("orientation"))


def _moved(start: pin.SE3, asked: dict[str, Any]) -> pin.SE3:
    """Return the pose of the tool after a relative move."""
    move = asked["move"]

    def shift(x: float, z: float) -> pin.SE3:
        return pin.SE3(np.eye(3), np.array([x, 0.0, z]))

    def turn(axis: str, angle: float) -> pin.SE3:
        return pin.SE3(Rotation.from_euler(axis, angle).as_matrix(), np.zeros(3))

    match move["kind"]:
        case "cartesian":
            step = placement({"position": move["translation"], "orientation": move.get("orientation")})
        case "cylindrical":
            step = shift(0.0, move["l"]) * turn("z", move["alpha"]) * shift(move["r"], 0.0)
        case _:
            step = turn("z", move["gamma"]) * turn("y", move["beta"]) * shift(0.0, move["r"])
    if asked["frame"] == "tool":
        return start * step
    return pin.SE3(step.rotation @ start.rotation, start.translation + step.translation)


def _keeps_to_curve(
    robot: Robot,
    request: dict[str, Any],
    segment: Segment,
    trajectory: Answered,
    times: dict[int, dict[str, Any]],
) -> None:
    """Check the tool positions against the line, circle, polyline or spline."""
    k = segment.index
    assert k is not None
    asked = request["waypoints"][k]
    motion = asked.get("motion", {"kind": "joint"}) if not asked.get("on") else {"kind": "joint"}
    shifts = isinstance(motion.get("free"), dict) and set("xyz") & motion["free"].keys()
    if motion["kind"] in ("joint", "free") or shifts:
        return
    into = in_base(robot, request, asked.get("frame") if asked["kind"] == "pose" else None)
    corners = motion.get("poses") or [motion["via"]] if motion["kind"] != "linear" else []
    start, end = (tool_at(robot, np.array(times[i]["position"]), segment.tool).translation for i in (k - 1, k))
    points = np.array([start, *(into.act(np.array(pose["position"])) for pose in corners), end])
    moments = np.linspace(segment.first, segment.last, ON_CURVE)
    tool = np.array([tool_at(robot, q, segment.tool).translation for q in trajectory.at(moments)[0]])
    tolerance = motion.get("tolerance_position", 1e-4) * 1.01 + 1e-6
    match motion["kind"]:
        case "linear" | "polyline":
            off = _off_polyline(tool, points)
            near_corner = np.linalg.norm(tool[:, None] - points[None, 1:-1], axis=2).min(axis=1, initial=np.inf)
            is_cut = near_corner <= motion.get("blend", -1.0) + tolerance
            assert (is_cut | (off <= tolerance)).all(), f"off the lines to waypoint {k} by {off.max()}"
            assert (off <= max(motion.get("blend", 0.0), tolerance)).all(), f"off the blends to waypoint {k}"
        case "circular":
            assert _off_circle(tool, points).max() <= tolerance, f"off the circle to waypoint {k}"
        case "spline":
            chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
            if chords.min() > 1e-6:
                along = np.concatenate([[0.0], np.cumsum(chords)])
                dense = CubicSpline(along, points, bc_type="natural")(np.linspace(0.0, along[-1], 400))
                assert _off_polyline(tool, dense).max() <= tolerance + 1e-4 * along[-1], f"off the spline to {k}"


def _moves_along(
    robot: Robot,
    request: dict[str, Any],
    segment: Segment,
    trajectory: Answered,
    times: dict[int, dict[str, Any]],
) -> None:
    """Check the tool on a moving object against its line, and its pose while it rests there."""
    k = segment.index
    assert k is not None
    asked, before = request["waypoints"][k], request["waypoints"][k - 1]
    (thing,) = (thing for thing in request["scene"]["objects"] if thing["id"] == asked["on"])
    goal = placement(asked["pose"])
    start = placement(before["pose"]) if before.get("on") == asked["on"] else goal
    begin = segment.first if before.get("on") == asked["on"] else segment.last
    for time in np.linspace(begin, times[k]["departure_time"], ON_CURVE).tolist():
        tool = tool_at(robot, trajectory.at(np.array([time]))[0][0], segment.tool)
        seen = thing_at(robot, request, thing, time).actInv(tool)
        line = np.array([start.translation, goal.translation])
        line = line[1:] if time > segment.last or not np.diff(line, axis=0).any() else line
        off = seen.translation - line[0] if len(line) == 1 else _off_polyline(seen.translation[None], line)
        assert np.linalg.norm(off) <= 1.01e-4, f"off the line on {asked['on']} to waypoint {k} at {time} s by {off}"
        if time >= segment.last:
            assert np.linalg.norm(pin.log3(goal.rotation.T @ seen.rotation)) <= 1.01e-3, f"turned at waypoint {k}"


def _off_polyline(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return distances (N,) of points (N, 3) from the polyline through corners (M, 3)."""
    starts, ways = corners[:-1], np.diff(corners, axis=0)
    squares = np.maximum((ways**2).sum(axis=1), 1e-300)
    shares = np.clip(((points[:, None] - starts) * ways).sum(axis=2) / squares, 0.0, 1.0)
    return np.asarray(np.linalg.norm(points[:, None] - starts - shares[..., None] * ways, axis=2).min(axis=1))


def _off_circle(points: np.ndarray, three: np.ndarray) -> np.ndarray:
    """Return distances (N,) of points (N, 3) from the circle through three."""
    a, b = three[1] - three[0], three[2] - three[0]
    normal = np.cross(a, b)
    middle = three[0] + np.cross((a @ a) * b - (b @ b) * a, normal) / (2.0 * (normal @ normal))
    normal /= np.linalg.norm(normal)
    above = (points - middle) @ normal
    around = np.linalg.norm(points - middle - above[:, None] * normal, axis=1)
    return np.asarray(np.hypot(around - np.linalg.norm(three[0] - middle), above))
