"""An agent that follows nothing but remedies: its share of infeasible requests that end in plans."""

from __future__ import annotations

import tempfile
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import anyio
import numpy as np
from mcp.client.client import Client

from api.base.json_pointers import changed
from cli.agents.server import planner_server
from cli.local_service import local_service
from planner.kinematics import forward_kinematics
from planner.robots import load_robot
from planner.spatial import quaternion

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.robots import Robot

ROBOTS = ("kuka_kr16_2", "kuka_kr16_l6_2", "ur5e", "ur10e", "fr3", "ngv_refuelling_arm", "welding_arm", "three_dof_arm")
"""The arms of the requests."""

MOST_CALLS = 3
"""The number of calls that the agent may make for a request."""

MARGIN = 0.15
"""The share of a joint's range that random positions keep from each of its limits."""

SPAN = 2.0
"""The range of a joint without position limits, rad or m, on each side of 0."""


class Ended(NamedTuple):
    """How a request ended.

    Attributes:
        kind: The reason that made it infeasible.
        calls: The number of calls.
        planned: Whether the last one returned a plan.
        codes: The codes of the refusals, in order.
    """

    kind: str
    calls: int
    planned: bool
    codes: tuple[str, ...]


def infeasible_requests(count: int, seed: int = 0) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield requests that cannot be planned as they are, each with the reason."""
    rng = np.random.default_rng(seed)
    kinds = (_short_segment, _short_whole, _beyond_limit, _out_of_reach, _far_line, _too_heavy)
    for k in range(count):
        kind, name = kinds[k % len(kinds)], ROBOTS[k // len(kinds) % len(ROBOTS)]
        yield kind.__name__.removeprefix("_"), kind(load_robot(name), rng)


def _range(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Return lower and upper ends of the positions that requests use."""
    lower, upper = (np.clip(robot.limit(side), -SPAN, SPAN) for side in ("lower", "upper"))
    margin = MARGIN * (upper - lower)
    return lower + margin, upper - margin


def _joint(position: np.ndarray, **others: Any) -> dict[str, Any]:
    return {"kind": "joint", "position": position.tolist(), **others}


def _swing(robot: Robot, rng: np.random.Generator) -> tuple[dict[str, Any], np.ndarray, np.ndarray]:
    """Return a request from one random joint position to another, and both."""
    first, last = rng.uniform(*_range(robot), (2, robot.dof))
    return {"robot": robot.id, "waypoints": [_joint(first), _joint(last)]}, first, last


def _short_segment(robot: Robot, rng: np.random.Generator) -> dict[str, Any]:
    request, first, last = _swing(robot, rng)
    least = float((np.abs(last - first) / robot.limit("velocity")).max())
    request["waypoints"][1]["duration"] = least * rng.uniform(0.1, 0.9)
    return request


def _short_whole(robot: Robot, rng: np.random.Generator) -> dict[str, Any]:
    request, first, last = _swing(robot, rng)
    request["waypoints"].append(_joint(first))
    least = float((np.abs(last - first) / robot.limit("velocity")).max())
    return request | {"duration": 2.0 * least * rng.uniform(0.1, 0.9)}


def _beyond_limit(robot: Robot, rng: np.random.Generator) -> dict[str, Any]:
    request, _, _ = _swing(robot, rng)
    bounded = np.flatnonzero(np.isfinite(robot.limit("upper")))
    if not len(bounded):
        return _short_segment(robot, rng)
    joint = int(rng.choice(bounded))
    request["waypoints"][1]["position"][joint] = float(robot.limit("upper")[joint] + rng.uniform(0.01, 0.5))
    return request


def _pose_out_of_reach(robot: Robot, rng: np.random.Generator) -> tuple[np.ndarray, dict[str, Any]]:
    """Return a joint position, and a pose beyond the length of all links end to end."""
    position = rng.uniform(*_range(robot))
    pose = forward_kinematics(robot, position)
    assert pose.rotation is not None  # noqa: S101 - that of a joint position
    reach = sum(float(np.linalg.norm(placement.translation)) for placement in robot.model.jointPlacements)
    reach += float(np.linalg.norm(robot.model.frames[robot.tool_frame_id].placement.translation))
    far = pose.position / np.linalg.norm(pose.position) * reach * rng.uniform(1.02, 1.5)
    orientation = {"kind": "quaternion", "xyzw": quaternion(pose.rotation).tolist()}
    return position, {"position": far.tolist(), "orientation": orientation}


def _out_of_reach(robot: Robot, rng: np.random.Generator) -> dict[str, Any]:
    position, pose = _pose_out_of_reach(robot, rng)
    return {"robot": robot.id, "waypoints": [_joint(position), {"kind": "pose", "pose": pose}]}


def _far_line(robot: Robot, rng: np.random.Generator) -> dict[str, Any]:
    position, pose = _pose_out_of_reach(robot, rng)
    motion = {"kind": "linear"}
    return {"robot": robot.id, "waypoints": [_joint(position), {"kind": "pose", "pose": pose, "motion": motion}]}


def _too_heavy(robot: Robot, rng: np.random.Generator) -> dict[str, Any]:
    request, _, _ = _swing(robot, rng)
    if robot.rated_payload is None:
        return _short_whole(robot, rng)
    return request | {"payload": {"mass": robot.rated_payload * rng.uniform(1.05, 3.0)}}


async def follow_remedies(client: Client, kind: str, request: dict[str, Any]) -> Ended:
    """Call the tool until there is a plan, no remedy, or `MOST_CALLS` are made."""
    codes: list[str] = []
    for calls in range(1, MOST_CALLS + 1):
        result = await client.call_tool("plan_trajectory", {"body": request})
        if not result.is_error:
            return Ended(kind, calls, True, tuple(codes))
        problem = result.structured_content
        codes.append(problem["code"])
        remedies = problem.get("remedies") or []
        if not remedies:
            break
        request = changed(request, remedies[0]["change"], remedies[0]["value"])
    return Ended(kind, len(codes), False, tuple(codes))


def measure(count: int) -> dict[str, Any]:
    """Return how many infeasible requests end in a plan, by the reason, and by the number of calls."""

    async def run(url: str) -> list[Ended]:
        async with Client(planner_server(url, None)) as client:
            return [await follow_remedies(client, *each) for each in infeasible_requests(count)]

    with tempfile.TemporaryDirectory() as folder, local_service(Path(folder) / "log.jsonl") as (url, _):
        ended = anyio.run(run, url)
    kinds = {
        kind: {"requests": len(own), "planned": sum(each.planned for each in own)}
        for kind in dict.fromkeys(each.kind for each in ended)
        if (own := [each for each in ended if each.kind == kind])
    }
    return {
        "requests": count,
        "planned": sum(each.planned for each in ended),
        "calls": dict(sorted(Counter(each.calls for each in ended if each.planned).items())),
        "kinds": kinds,
        "last_codes_without_plan": dict(Counter(each.codes[-1] for each in ended if not each.planned)),
    }


def print_table(figures: dict[str, Any]) -> None:
    """Print the figures for a person."""
    print(f"{figures['planned']} of {figures['requests']} requests end in a plan within {MOST_CALLS} calls")
    for kind, own in figures["kinds"].items():
        print(f"  {kind.replace('_', ' '):16s} {own['planned']:4d} of {own['requests']}")
    print(f"calls to a plan: {figures['calls']}; codes without one: {figures['last_codes_without_plan']}")
