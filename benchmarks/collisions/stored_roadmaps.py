"""Plans of free motions over HTTP in stored scenes: without a roadmap, with it, and after a change of the scene."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx
import numpy as np

from benchmarks.collisions.roadmaps import ends_of_queries, lowered
from benchmarks.collisions.scenes import KINDS, problem
from benchmarks.machine import machine
from cli.local_service import local_service
from planner.free_motion.roadmaps.building import DEFAULT_SAMPLES
from planner.robots import load_robot
from planner.scene import CollisionChecker
from planner.shapes import Box, Cylinder

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchmarks.collisions.scenes import Problem
    from planner.robots import Robot
    from planner.scene import SceneObject
    from planner.spatial import FloatArray

DEADLINE = 60.0
"""The deadline of each request, s: longer than any of them takes."""

STATES = ("without a roadmap", "with it", "after a change")
"""The states of a stored scene in which its queries are planned."""


def measure(arms: Sequence[str], queries: int, samples: int = DEFAULT_SAMPLES) -> dict[str, Any]:
    """Plan so many motions near the work positions of each kind of scene over HTTP; return latencies, s."""
    where, headers = machine(), {"Cache-Control": "no-cache"}
    with (
        tempfile.TemporaryDirectory() as folder,
        local_service(Path(folder, "log"), workers=1) as (url, _),
        httpx.Client(base_url=url, timeout=2.0 * DEADLINE, headers=headers) as client,
    ):
        return {"machine": where, "arms": {arm: _of_arm(client, load_robot(arm), queries, samples) for arm in arms}}


def _of_arm(client: httpx.Client, robot: Robot, queries: int, samples: int) -> dict[str, Any]:
    found: dict[str, list[tuple[float, float]]] = {state: [] for state in STATES}
    builds, changes = [], []
    for kind in KINDS:
        asked = problem(robot, kind, 0)
        checker = CollisionChecker(robot, asked.scene, self_collision=True)
        ends = list(ends_of_queries(robot, asked, checker, queries))
        scene = f"{robot.id}_{kind}"
        _sent(client, "POST", "/v1/scenes", {"id": scene, "objects": [_described(one) for one in asked.scene.objects]})
        own = [_planned(client, robot, scene, ends)]
        body = {"robot": robot.id, "samples": samples, "positions": _positions(asked), "deadline": DEADLINE}
        builds.append(_sent(client, "POST", f"/v1/scenes/{scene}/roadmap", body)[0])
        own.append(_planned(client, robot, scene, ends))
        changes.append(_sent(client, "PATCH", f"/v1/scenes/{scene}", {"objects": [_described(lowered(asked))]})[0])
        own.append(_planned(client, robot, scene, ends))
        with_detours = [k for k in range(len(ends)) if all(rows[k] is not None for rows in own)]
        for state, rows in zip(STATES, own, strict=True):
            found[state] += [row for k in with_detours if (row := rows[k]) is not None]
    return {
        "build": float(np.median(builds)),
        "change": float(np.median(changes)),
        **{state: _summary(rows) for state, rows in found.items()},
    }


def _planned(
    client: httpx.Client, robot: Robot, scene: str, ends: Sequence[tuple[FloatArray, FloatArray]]
) -> list[tuple[float, float] | None]:
    """Return latency and time of planning, s, of each motion; None: it is refused, or straight."""
    rows: list[tuple[float, float] | None] = []
    for start, goal in ends:
        waypoints = [
            {"kind": "joint", "position": start.tolist()},
            {"kind": "joint", "position": goal.tolist(), "motion": {"kind": "free"}},
        ]
        body = {"robot": robot.id, "waypoints": waypoints, "scene": scene, "deadline": DEADLINE}
        seconds, answer = _sent(client, "POST", "/v1/trajectories", body)
        is_detour = answer.status_code == httpx.codes.OK and len(answer.json()["waypoints"]) > len(waypoints)
        stages = dict(part.split(";dur=") for part in answer.headers["Server-Timing"].split(", "))
        rows.append((seconds, float(stages["plan"]) / 1e3) if is_detour else None)
    return rows


def _sent(client: httpx.Client, method: str, path: str, body: dict[str, Any]) -> tuple[float, httpx.Response]:
    begun = time.perf_counter()
    answer = client.request(method, path, json=body)
    seconds = time.perf_counter() - begun
    if answer.is_error and answer.status_code != httpx.codes.UNPROCESSABLE_ENTITY:
        raise RuntimeError(f"{method} {path}: {answer.text}")
    return seconds, answer


def _positions(asked: Problem) -> list[list[float]]:
    return [asked.start.tolist(), asked.goal.tolist()]


def _described(thing: SceneObject) -> dict[str, Any]:
    """Return an object of a box or a cylinder as requests have it."""
    (shape,) = thing.shapes
    if isinstance(shape, Box):
        described: dict[str, Any] = {"kind": "box", "size": list(shape.size)}
    elif isinstance(shape, Cylinder):
        described = {"kind": "cylinder", "radius": shape.radius, "length": shape.length}
    else:
        raise TypeError(f"scenes have boxes and cylinders; got {type(shape).__name__}")
    return {"id": thing.id, "shape": described, "pose": {"position": thing.pose.position.tolist()}}


def _summary(rows: Sequence[tuple[float, float]]) -> dict[str, Any]:
    medians, highest = np.median(rows, axis=0).tolist(), np.quantile(rows, 0.95, axis=0).tolist()
    return {
        "queries": len(rows),
        "latency": {"median": medians[0], "p95": highest[0]},
        "plan": {"median": medians[1], "p95": highest[1]},
    }


def print_table(figures: dict[str, Any]) -> None:
    """Print the figures for a person."""
    where = figures["machine"]
    print(f"{where['processor']}, {where['cores']} cores, Python {where['python']}")
    print("Detours over HTTP near work positions: median and p95, ms")
    print(f"{'arm':8}{'':20}{'queries':>8}{'latency':>18}{'of it planning':>18}")
    for arm, of_arm in figures["arms"].items():
        for state in STATES:
            one = of_arm[state]
            latency, planning = (
                f"{1e3 * one[k]['median']:.1f}, {1e3 * one[k]['p95']:.1f}" for k in ("latency", "plan")
            )
            print(f"{arm:8}{state:20}{one['queries']:>8}{latency:>18}{planning:>18}")
        print(f"{'':8}built in {of_arm['build']:.2f} s, proved again after a change in {of_arm['change']:.2f} s")
