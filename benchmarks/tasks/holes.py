"""Drill holes in any order, beside the nearest hole first with 2-opt in Cartesian space."""

from __future__ import annotations

import time
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

import planner

if TYPE_CHECKING:
    from planner.spatial import FloatArray

PLATE = (0.3, -0.45, 0.1), (0.65, 0.45, 0.1)
"""Corners of a plate with holes in the base frame, m."""

BLOCK = (0.4, -0.25, 0.05), (0.6, 0.25, 0.3)
"""Corners of a block with holes in five faces, m."""

Face = tuple[tuple[float, ...], tuple[float, ...], int]


def face(axis: int, end: float) -> Face:
    """Return the face of the block at one end along an axis."""
    low, high = (tuple(end if k == axis else corner[k] for k in range(3)) for corner in BLOCK)
    return low, high, axis


FACES: dict[str, list[Face]] = {
    "plate": [(*PLATE, 2)],
    "block": [
        face(0, BLOCK[0][0]),
        face(0, BLOCK[1][0]),
        face(1, BLOCK[0][1]),
        face(1, BLOCK[1][1]),
        face(2, BLOCK[1][2]),
    ],
}
"""The faces with holes of each part: two corners, and the axis across."""

MIDDLES = {"plate": (0.5, 0.0, -1.0), "block": tuple(np.mean(BLOCK, axis=0).tolist())}
"""The point of each part that the drill points to, across the face."""


def holes(part: str, count: int, seed: int) -> list[planner.Pose]:
    """Draw holes in the faces of a part that the arm can reach with the drill straight into the face."""
    random, robot, found = np.random.default_rng(seed), planner.load_robot("ur5e"), list[planner.Pose]()
    while len(found) < count:
        low, high, axis = FACES[part][int(random.integers(len(FACES[part])))]
        position = random.uniform(low, high)
        inwards = np.zeros(3)
        inwards[axis] = np.sign(MIDDLES[part][axis] - position[axis])
        across = np.roll(np.abs(inwards), 1)
        pose = planner.Pose(position, np.column_stack([across, np.cross(inwards, across), inwards]))
        if planner.all_solutions(robot, pose):
            found.append(pose)
    return found


def measure(part: str, count: int, seed: int, backend: str) -> dict[str, Any]:
    """Order and plan random holes, and plan the same holes in the order by distance.

    Args:
        part: The part, `plate` or `block`.
        count: The number of holes.
        seed: The seed of their positions.
        backend: The kind of the back end of all plans.
    """
    robot, poses = planner.load_robot("ur5e"), holes(part, count, seed)
    waypoints = [planner.PoseWaypoint(pose, free="rotation_z") for pose in poses]
    home = planner.JointWaypoint.named(robot, "home")
    problem = planner.PlanningProblem(robot, [home, home])

    began, processor = time.monotonic(), time.process_time()
    ordered = planner.order_tasks(problem, [planner.Task([waypoint]) for waypoint in waypoints], backend)
    seconds, processor = time.monotonic() - began, time.process_time() - processor

    start = planner.tool_pose(robot, np.array(home.position)).position
    by_length = by_distance(np.vstack([start, *(pose.position for pose in poses)]))[1:]
    durations = []
    for free in ("rotation_z", None):
        in_order = [planner.PoseWaypoint(poses[k - 1], free=free) for k in by_length]
        plan = planner.plan(planner.PlanningProblem(robot, [home, *in_order, home]), backend)
        durations.append(plan.trajectory.duration)
    baseline = min(durations)
    duration = ordered.plan.trajectory.duration
    return {
        "part": part,
        "holes": count,
        "backend": backend,
        "duration": duration,
        "bound": ordered.bound,
        "gap": ordered.gap,
        "seconds": seconds,
        "processor_seconds": processor,
        "duration_by_distance": baseline,
        "saved": 1.0 - duration / baseline,
    }


def by_distance(points: FloatArray) -> list[int]:
    """Return a closed tour (points,) from the first point: the nearest next, then 2-opt until nothing is shorter."""
    distances = np.linalg.norm(points[:, None] - points, axis=2)
    tour, left = [0], set(range(1, len(points)))
    while left:
        tour.append(min(left, key=lambda k: float(distances[tour[-1], k])))
        left.remove(tour[-1])
    is_shorter = True
    while is_shorter:
        is_shorter = False
        for i in range(1, len(tour) - 1):
            ends = np.array([*tour[i + 1 :], tour[0]])
            lasts = np.array(tour[i:])
            kept = distances[tour[i - 1], tour[i]] + distances[lasts, ends]
            turned = distances[tour[i - 1], lasts] + distances[tour[i], ends]
            best = int((kept - turned).argmax())
            if kept[best] - turned[best] > 1e-12:
                tour[i : i + best + 1] = tour[i : i + best + 1][::-1]
                is_shorter = True
    return tour


def tour_length(points: FloatArray, tour: list[int]) -> float:
    """Return the length of a closed tour, in the unit of the points."""
    return sum(float(np.linalg.norm(points[a] - points[b])) for a, b in pairwise([*tour, tour[0]]))


def print_table(figures: dict[str, Any]) -> None:
    """Print the figures for a person."""
    print(f"{figures['holes']} holes in a {figures['part']}, UR5e, {figures['backend']}")
    print(f"certified duration        {figures['duration']:8.2f} s after {figures['seconds']:.1f} s of computing")
    print(f"lower bound               {figures['bound']:8.2f} s, gap {100.0 * figures['gap']:.1f} %")
    alone, saved = figures["duration_by_distance"], 100.0 * figures["saved"]
    print(f"nearest hole and 2-opt    {alone:8.2f} s, of which {saved:.1f} % is saved")
