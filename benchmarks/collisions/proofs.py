"""Times of proofs that a trajectory is collision-free among many objects, and of its clearance."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

import planner
from planner.scene import CollisionChecker, PointCloud, Scene, SceneObject, clearances
from planner.shapes import Box
from planner.spatial import Pose

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.spatial import FloatArray
    from planner.trajectories.trajectory import Trajectory

MOTIONS = 5
"""Number of motions for each problem of a requested kind."""

OBJECTS = (10, 30, 100, 1000)
"""Numbers of boxes around the arm."""

POINTS = 100_000
"""Number of points around it instead."""

VOXEL = 0.02
"""Side of the voxels of these points, m."""

TOLERANCE = 1e-3
"""How well the clearance is measured, m."""


def measure_proofs(robot: Robot, count: int) -> dict[str, dict[str, Any]]:
    """Prove random motions of an arm free, and measure their clearance; only free motions count."""
    rng = np.random.default_rng(0)
    lower, upper = np.maximum(robot.limit("lower"), -2.5), np.minimum(robot.limit("upper"), 2.5)
    motions = []
    for _ in range(MOTIONS * count):
        ends = [planner.JointWaypoint(q) for q in rng.uniform(lower, upper, (2, robot.dof))]
        motions.append(planner.plan(planner.PlanningProblem(robot, ends), planner.Quintic()).trajectory)
    reach = np.linalg.norm(sum(np.abs(placement.translation) for placement in robot.model.jointPlacements.tolist()))
    scenes = {f"{number} objects": [_box(rng, float(reach), k, number) for k in range(number)] for number in OBJECTS}
    points = np.array([_place(rng, float(reach), 3.0) for _ in range(POINTS)])
    scenes[f"{POINTS} points"] = [SceneObject("points", [PointCloud(points, 0.005, VOXEL)])]
    return {name: _measured(CollisionChecker(robot, Scene(things)), motions) for name, things in scenes.items()}


def _measured(checker: CollisionChecker, motions: list[Trajectory]) -> dict[str, Any]:
    proofs, clearance = [], []
    for motion in motions:
        begun = time.process_time()
        free = clearances(checker, motion).is_proved
        between = time.process_time()
        if free:
            proofs.append(between - begun)
            clearances(checker, motion, tolerance=TOLERANCE)
            clearance.append(time.process_time() - between)

    def quantiles(seconds: list[float]) -> dict[str, float] | None:
        if not seconds:
            return None
        return {"p50": float(np.median(seconds)), "p95": float(np.quantile(seconds, 0.95))}

    return {"free": len(proofs), "of": len(motions), "proof": quantiles(proofs), "clearance": quantiles(clearance)}


def _box(rng: np.random.Generator, reach: float, number: int, of: int) -> SceneObject:
    size = reach * rng.uniform(0.03, 0.15, 3)
    return SceneObject(f"box_{number}", [Box(size)], Pose(_place(rng, reach, 1.2 if of < 100 else 3.0)))


def _place(rng: np.random.Generator, reach: float, far: float) -> FloatArray:
    """Draw a place around an arm, not in its middle."""
    while True:
        direction = rng.normal(size=3)
        place: FloatArray = direction / np.linalg.norm(direction) * reach * rng.uniform(0.5, far)
        if np.hypot(place[0], place[1]) > 0.35 * reach:
            place[2] += 0.3 * reach
            return place
