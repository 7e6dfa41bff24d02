"""Bounds on deviations from paths: no dense sample exceeds them, and each is almost reached."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from planner import (
    BlendTransition,
    Check,
    CircularMotion,
    JointWaypoint,
    LinearMotion,
    Plan,
    PlanningProblem,
    PolylineMotion,
    Pose,
    PoseWaypoint,
    SingularPath,
    SplineMotion,
    StopTransition,
    UnreachableWaypoint,
    forward_kinematics,
    load_robot,
    plan,
)
from planner.certificate.path_bounds import DEVIATION_KNOWN_TO
from planner.certificate.path_parts import PARTS_KNOWN_TO
from planner.certificate.tool_path import certify_tool_path
from planner.certificate.waypoints import certify_waypoints
from planner.spatial import FloatArray
from planner.tool_motions.polylines import Polyline
from planner.tool_motions.pose_splines import PoseSpline
from planner.trajectories.trajectory import Trajectory
from tests.sizes import NAME

STARTS = {
    "kuka_kr16_2": (0.2, -1.2, 1.4, 0.3, 0.8, 0.1),
    "ur5e": (0.2, -1.4, 1.6, -1.5, -1.4, 0.1),
    "fr3": (0.1, -0.3, 0.2, -1.9, 0.2, 1.7, 0.5),
}
"""Joint positions, rad, with space for paths around them."""

SAMPLES = 300 if NAME == "soak" else 20
"""Samples of each trajectory."""

FRACTIONS = np.linspace(0.0, 1.0, 401)
"""Fractions of a path at which the search for the nearest pose starts."""

ROUNDINGS = 6
"""Number of refinements of the search between the neighbours of the best fraction, each 50 times finer."""

ROUNDING = 1e-10
"""Deviations below this are rounding, m and rad."""

FLOOR = ROUNDING + 4.0 * PARTS_KNOWN_TO
"""Accuracy of bounds whatever the deviation, m and rad: polylines and splines are known to this."""

SEEDS = range(60 if NAME == "soak" else 1)
"""Seeds of random paths."""

BACK_ENDS = ("toppra", "cubic", "trapezoidal", "ruckig")

PAIRS = [
    (name, backend)
    for row, name in enumerate(STARTS)
    for column, backend in enumerate(BACK_ENDS)
    if NAME != "quick" or column % len(STARTS) == row
]
"""Robots and back ends: every pair, in the quick size each back end with one robot."""


def moved(pose: Pose, shift: list[float], turn: list[float]) -> Pose:
    assert pose.rotation is not None
    other = Pose.from_rpy(shift, turn)
    return Pose(pose.position + pose.rotation @ other.position, pose.rotation @ other.rotation)


def paths(pose: Pose, seed: int) -> dict[str, list[PoseWaypoint]]:
    """Return paths that start at a pose: lines, circles, polylines, splines, turns on the spot, and cut corners."""
    rng = np.random.default_rng(seed)
    shifts, turns = rng.uniform(-0.08, 0.08, (4, 3)), rng.uniform(-0.3, 0.3, (4, 3))
    goals = [moved(pose, *each) for each in zip(shifts.tolist(), turns.tolist(), strict=True)]
    angles = (3.0 + rng.uniform(-0.5, 0.5), 6.2)  # almost the whole circle
    round_about = [moved(pose, [0.05 * np.cos(a) - 0.05, 0.05 * np.sin(a), 0.0], [0.0] * 3) for a in angles]
    line, flat = LinearMotion(), [Pose(goal.position) for goal in goals]
    blends = [BlendTransition(radius=0.015)] * 3 + [StopTransition()]
    return {
        "lines": [PoseWaypoint(pose=goal, motion=line) for goal in goals],
        "circle": [PoseWaypoint(pose=goals[1], motion=CircularMotion(via=goals[0]))],
        "round about": [PoseWaypoint(pose=round_about[1], motion=CircularMotion(via=round_about[0]))],
        "on the spot": [PoseWaypoint(pose=moved(pose, [0.0] * 3, turns[0].tolist()), motion=line)],
        "positions": [PoseWaypoint(pose=Pose(goals[2].position), motion=line)],
        "blends": [PoseWaypoint(pose=g, motion=line, transition=t) for g, t in zip(goals, blends, strict=True)],
        "polyline": [PoseWaypoint(pose=goals[3], motion=PolylineMotion(poses=goals[:3], blend=0.02))],
        "spline": [PoseWaypoint(pose=goals[3], motion=SplineMotion(poses=goals[:3]))],
        "corners": [PoseWaypoint(pose=flat[3], motion=PolylineMotion(poses=flat[:3], blend=0.02))],
        "tiny": [PoseWaypoint(pose=moved(pose, [1e-5, 0.0, 0.0], [0.0, 0.2, 0.0]), motion=line)],
    }


def disturbed(trajectory: Trajectory, seed: int) -> Trajectory:
    """Return a trajectory with a bump of up to 0.1 mrad on each piece."""
    lengths, coefficients = trajectory.lengths, trajectory.coefficients
    bump = np.zeros((*coefficients.shape[:2], max(5, coefficients.shape[2])))
    bump[:, :, 2:5] = np.random.default_rng(seed).uniform(-1e-4, 1e-4, coefficients.shape[:2])[..., None]
    bump[:, :, 2:5] *= 16.0 * np.array([1.0, -2.0, 1.0]) / lengths[:, None, None] ** np.arange(2, 5)
    bump[:, :, : coefficients.shape[2]] += coefficients
    return replace(trajectory, coefficients=bump)


def checks_of(done: Plan, trajectory: Trajectory) -> dict[str, Check]:
    blended = [k for group in done.path.groups for k in group.blended]
    met = certify_waypoints(trajectory, done.problem, done.path.positions, blended)
    problem, solved = done.problem, done.path.waypoints
    checks = certify_tool_path(trajectory, problem.robots, problem.waypoints, solved, met.targets)
    return {check.quantity: check for check in checks}


def path_of(waypoint: PoseWaypoint, start: Pose) -> Polyline | PoseSpline:
    if isinstance(waypoint.motion, PolylineMotion):
        return Polyline.through(start, waypoint.motion.poses, waypoint.pose, waypoint.motion.blend)
    assert isinstance(waypoint.motion, SplineMotion)
    return PoseSpline.through(start, waypoint.motion.poses, waypoint.pose)


def requested(waypoint: PoseWaypoint, start: Pose, u: FloatArray) -> tuple[FloatArray, Rotation | None]:
    """Return positions (N, 3) and rotations at fractions of the requested path.

    Lines and circles are by formulas of this test; polylines and splines have tests of their own.
    """
    if isinstance(waypoint.motion, PolylineMotion | SplineMotion):
        positions, matrices = path_of(waypoint, start).poses(u)
        return positions, None if matrices is None else Rotation.from_matrix(matrices)
    a, c = start.position, waypoint.pose.position
    oriented = start.rotation is not None and waypoint.pose.rotation is not None
    if not isinstance(waypoint.motion, CircularMotion):
        positions, share = a + u[:, None] * (c - a), None
    else:
        b = waypoint.motion.via.position
        # The center by barycentric weights of the triangle's sides.
        squares = [float(np.sum((p - q) ** 2)) for p, q in ((b, c), (c, a), (a, b))]
        weights = np.array([squares[i] * (sum(squares) - 2.0 * squares[i]) for i in range(3)])
        center = weights @ np.array([a, b, c]) / weights.sum()
        axis = np.cross(b - a, c - a)
        axis /= np.linalg.norm(axis)
        angle_to_c, angle_to_b = (
            np.arctan2(axis @ np.cross(a - center, p - center), (a - center) @ (p - center)) % (2.0 * np.pi)
            for p in (c, b)
        )
        positions = center + Rotation.from_rotvec(np.outer(u * angle_to_c, axis)).apply(a - center)
        share = angle_to_b / angle_to_c
    if not oriented:
        return positions, None
    first = Rotation.from_matrix(start.rotation)
    whole = (first.inv() * Rotation.from_matrix(waypoint.pose.rotation)).as_rotvec()
    if share is None:
        return positions, first * Rotation.from_rotvec(np.outer(u, whole))
    half = (first.inv() * Rotation.from_matrix(waypoint.motion.via.rotation)).as_rotvec()
    second = (half - share * whole) / (share * share - share)
    return positions, first * Rotation.from_rotvec(np.outer(u, whole - second) + np.outer(u * u, second))


def least_uses(poses: list[Pose], waypoint: PoseWaypoint, start: Pose, allowed: FloatArray) -> FloatArray:
    """Return each pose's larger share of the allowed distance and angle at the best fraction of the path."""
    points, each = np.array([pose.position for pose in poses]), np.arange(len(poses))
    grids, best = np.tile(FRACTIONS, (len(poses), 1)), np.zeros(len(poses))
    for _ in range(1 + ROUNDINGS):
        count = grids.shape[1]
        positions, rotations = requested(waypoint, start, grids.ravel())
        uses = np.linalg.norm(positions.reshape(-1, count, 3) - points[:, None], axis=2) / allowed[0]
        if rotations is not None:
            matrices = np.array([pose.rotation for pose in poses])
            angles = (rotations.inv() * Rotation.from_matrix(matrices.repeat(count, axis=0))).magnitude()
            uses = np.maximum(uses, angles.reshape(-1, count) / allowed[1])
        at = uses.argmin(axis=1)
        best = uses[each, at]
        ends = grids[each, np.maximum(at - 1, 0)], grids[each, np.minimum(at + 1, count - 1)]
        grids = np.linspace(*ends, 101, axis=1)
    return best


@pytest.mark.parametrize(("name", "backend"), PAIRS)
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.sized
def test_no_sample_is_farther_from_its_path_than_the_bound(seed: int, name: str, backend: str) -> None:
    robot = load_robot(name).with_tool(Pose.from_rpy([0.03, 0.0, 0.12], [0.2, 0.4, 0.0]))
    start = JointWaypoint(position=STARTS[name])
    for kind, waypoints in paths(forward_kinematics(robot, STARTS[name]), seed).items():
        try:
            done = plan(PlanningProblem(robot, [start, *waypoints]), backend)
        except (UnreachableWaypoint, SingularPath):
            continue  # a random circle leaves the room of the arm
        poses = [forward_kinematics(robot, STARTS[name]), *(each.pose for each in waypoints)]
        radii = [each.transition.radius if isinstance(each.transition, BlendTransition) else 0.0 for each in waypoints]
        centers = np.array([pose.position for pose in poses])
        for trajectory in (done.trajectory, disturbed(done.trajectory, seed)):
            checks = checks_of(done, trajectory)
            position = checks["path_position_deviation"]
            orientation = checks.get("path_orientation_deviation", position)
            assert {position.method, orientation.method} == {"bounded"}
            allowed = np.array([position.peak, orientation.peak]) + ROUNDING
            for check in (position, orientation):
                assert check.lower is not None
                assert check.lower <= check.peak <= check.lower * (1.0 + DEVIATION_KNOWN_TO) + FLOOR, kind
            times = np.random.default_rng(seed).uniform(0.0, trajectory.duration, SAMPLES)
            (joints,) = trajectory.evaluate(times, [0])
            segments = trajectory.segments[trajectory.locate(times)[0]]
            for segment, waypoint in enumerate(waypoints):
                ends, within = centers[segment : segment + 2], np.array([0.0, *radii])[segment : segment + 2]
                reached = [forward_kinematics(robot, q) for q in joints[segments == segment]]
                off = [each for each in reached if (np.linalg.norm(ends - each.position, axis=1) > within).all()]
                uses = least_uses(off, waypoint, poses[segment], allowed) if off else np.zeros(1)
                assert uses.max() <= 1.0 + 1e-6, (kind, segment)


@pytest.mark.long_table
@pytest.mark.parametrize("kind", ["lines", "circle", "on the spot", "polyline", "spline"])
def test_a_bound_is_reached_at_its_time(kind: str) -> None:
    robot = load_robot("ur5e")
    here = forward_kinematics(robot, STARTS["ur5e"])
    waypoints = paths(here, 0)[kind]
    done = plan(PlanningProblem(robot, [JointWaypoint(position=STARTS["ur5e"]), *waypoints]), "toppra")
    trajectory = disturbed(done.trajectory, 0)
    poses = [here, *(each.pose for each in waypoints)]
    for which, check in enumerate(
        checks_of(done, trajectory)[f"path_{each}_deviation"] for each in ("position", "orientation")
    ):
        (q,) = trajectory.evaluate(check.time, [0])
        segment = int(trajectory.segments[trajectory.locate(np.array([check.time]))[0][0]])
        loose = np.full(2, 1.0)
        loose[which] = check.peak
        (other,) = least_uses([forward_kinematics(robot, q)], waypoints[segment], poses[segment], loose)
        assert other <= 1.0 + 1e-6


@pytest.mark.parametrize("seed", [6, 24])
def test_a_spline_of_positions_with_sharp_bends_is_near_itself(seed: int) -> None:
    """A bend of such a spline has several nearest points; searches from its chord found the wrong one."""
    robot, rng = load_robot("ur5e"), np.random.default_rng(seed)
    here, count = forward_kinematics(robot, STARTS["ur5e"]), int(rng.integers(2, 9))
    goals = [Pose(moved(here, shift, [0.0] * 3).position) for shift in rng.uniform(-0.1, 0.1, (count, 3)).tolist()]
    goal = PoseWaypoint(pose=goals[-1], motion=SplineMotion(poses=goals[:-1]))
    done = plan(PlanningProblem(robot, [JointWaypoint(position=STARTS["ur5e"]), goal]), "quintic")
    (check,) = (each for each in done.certificate.checks if each.quantity == "path_position_deviation")
    assert check.method == "bounded"
    assert check.peak < 1e-4
