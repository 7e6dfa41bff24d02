"""Searches for free motions with a roadmap and without, before and after a change of the scene."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

import planner
from benchmarks.collisions.scenes import KINDS, problem
from benchmarks.machine import machine
from planner.free_motion.free_path import find_free_path
from planner.free_motion.roadmaps.building import DEFAULT_SAMPLES
from planner.free_motion.shortcuts import lengths
from planner.robots import load_robot
from planner.scene import CollisionChecker, is_free

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from benchmarks.collisions.scenes import Problem
    from planner.robots import Robot
    from planner.scene import Scene, SceneObject
    from planner.spatial import FloatArray

NEAR = 0.05
"""Standard deviation of the ends of queries from the positions at which the robot works, rad."""

SHIFT = 0.03
"""The distance by which the change of a scene moves one object, m."""


def measure(arms: Sequence[str], queries: int, samples: int = DEFAULT_SAMPLES) -> dict[str, Any]:
    """Search so many motions near the work positions of each kind of scene, for each arm, with processor times."""
    return {"machine": machine(), "arms": {arm: _of_arm(load_robot(arm), queries, samples) for arm in arms}}


def _of_arm(robot: Robot, queries: int, samples: int) -> dict[str, Any]:
    _ = robot.collision_pairs  # which is not prepared for each scene
    found: dict[str, list[tuple[float, ...]]] = {"before": [], "after": []}
    builds, changes, sizes = [], [], []
    for kind in KINDS:
        asked = problem(robot, kind, 0)
        ends = [asked.start.tolist(), asked.goal.tolist()]
        fixed: dict[str, Any] = {"samples": samples, "positions": ends, "self_collision": True}
        begun = time.process_time()
        roadmap = planner.build_roadmap(robot, asked.scene, **fixed)
        builds.append(time.process_time() - begun)
        scene = replace(asked.scene, objects=[*asked.scene.objects[:-1], lowered(asked)])
        begun = time.process_time()
        changed = planner.build_roadmap(robot, scene, **fixed, earlier=roadmap)
        changes.append(time.process_time() - begun)
        sizes.append(len(roadmap.to_bytes()))
        found["before"] += _searches(robot, asked, asked.scene, roadmap, queries)
        found["after"] += _searches(robot, asked, scene, changed, queries)
    return {
        "build": float(np.median(builds)),
        "change": float(np.median(changes)),
        "bytes": max(sizes),
        **{when: _summary(np.array(rows)) for when, rows in found.items()},
    }


def ends_of_queries(
    robot: Robot, asked: Problem, checker: CollisionChecker, queries: int
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield the joint positions (joints,) at the ends of at most so many motions, if they are collision-free."""
    rng = np.random.default_rng(0)
    lower, upper = robot.limit("lower"), robot.limit("upper")
    for _ in range(queries):
        start, goal = (np.clip(end + NEAR * rng.normal(size=robot.dof), lower, upper) for end in asked[3:])
        if is_free(checker, np.array([start, goal])).all():
            yield start, goal


def lowered(asked: Problem) -> SceneObject:
    """Return the last object of the scene where the change puts it."""
    last = asked.scene.objects[-1]
    return replace(last, pose=replace(last.pose, position=last.pose.position + np.array([0.0, 0.0, -SHIFT])))


def _searches(
    robot: Robot, asked: Problem, scene: Scene, roadmap: planner.Roadmap, queries: int
) -> list[tuple[float, ...]]:
    """Return times, s, and lengths of paths without the roadmap and with it, where a detour is found."""
    checker = CollisionChecker(robot, scene, self_collision=True)
    rows: list[tuple[float, ...]] = []
    for start, goal in ends_of_queries(robot, asked, checker, queries):
        paths, taken = [], []
        for one in (None, roadmap):
            begun = time.process_time()
            paths.append(find_free_path(robot, checker, start, goal[None], roadmap=one))
            taken.append(time.process_time() - begun)
            if paths[0].status == "enclosed":
                return rows  # and so are the others
        if all(path.status == "found" and len(path.positions) > 2 for path in paths):
            rows.append((*taken, *(float(lengths(path.positions).sum()) for path in paths)))
    return rows


def _summary(rows: FloatArray) -> dict[str, Any]:
    medians, highest = np.median(rows, axis=0), np.quantile(rows, 0.95, axis=0)
    return {
        "queries": len(rows),
        "without": {"median": float(medians[0]), "p95": float(highest[0])},
        "with": {"median": float(medians[1]), "p95": float(highest[1])},
        "length": float(np.median(rows[:, 3] / rows[:, 2])),
    }


def print_table(figures: dict[str, Any]) -> None:
    """Print the figures for a person."""
    where = figures["machine"]
    print(f"{where['processor']}, {where['cores']} cores, Python {where['python']}")
    print("Searches for free motions near work positions: median and p95 of processor time, ms")
    print(f"{'arm':14}{'':8}{'queries':>8}{'without roadmap':>20}{'with it':>18}{'length':>8}")
    for arm, of_arm in figures["arms"].items():
        for when in ("before", "after"):
            one = of_arm[when]
            times = [f"{1e3 * one[how][k]:.1f}" for how in ("without", "with") for k in ("median", "p95")]
            both = f"{times[0]:>12}{times[1]:>8}{times[2]:>10}{times[3]:>8}"
            print(f"{arm:14}{when:8}{one['queries']:>8}{both}{one['length']:>8.2f}")
        print(f"{'':14}built in {of_arm['build']:.2f} s, changed in {of_arm['change']:.2f} s, {of_arm['bytes']} bytes")
