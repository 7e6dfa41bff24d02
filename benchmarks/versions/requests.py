"""The requests by which two versions of the service are compared, and the cost of each answer for the robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson

from benchmarks.plain_urdf import plain_urdf
from planner.kinematics import forward_kinematics
from planner.robots import catalogue_ids, load_robot

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.robots import Robot
    from planner.spatial import FloatArray, Pose

    Document = dict[str, Any]
    Cost = Callable[[Document, Document], float]

HOMES = {
    "kuka_kr16_l6_2": (0.0, -1.5, 1.5, 0.0, 0.8, 0.0),
    "ur5": (0.0, -1.2, 1.8, -0.6, 1.6, 0.3),
    "panda": (0.0, -0.4, 0.0, -2.0, 0.0, 1.9, 0.8),
}
"""rad: the joint position of each arm about which the waypoints lie, bent and away from the limits."""

BACK_ENDS: tuple[dict[str, Any], ...] = (
    {"kind": "cubic"},
    {"kind": "quintic"},
    {"kind": "trapezoidal"},
    {"kind": "ruckig"},
    {"kind": "toppra"},
    {"kind": "min_effort"},
)

WAYPOINTS = (3, 10, 50)
"""Lengths of the lists of joint waypoints."""

SLOW, MOST_FOR_SLOW = "min_effort", 10
"""A back end that takes seconds for longer lists, and the most waypoints that it gets."""

VARIANTS, VARIANTS_OF_SLOW = 8, 2
"""Number of different requests of a kind, and of one that this back end answers."""

POSES = 1000
"""Poses of a request for many solutions: the most that the service takes by default."""

SINGLE_POSES = 40
"""Number of requests for the solution of one pose."""

SPREAD, STRIDE = 0.7, 0.4
"""rad: largest distances in each joint of waypoints from home, and from one to the next."""

MOVE, BLEND = 0.08, 0.015
"""m: the longest move along each axis of a straight line, and the radius between two lines."""

NEAR = 0.1
"""rad: largest distance in each joint of a near reference from a solution."""

SAMPLE_PERIOD = 0.05
"""s: so long that planning takes the time, and not writing the samples."""


@dataclass(frozen=True)
class Kind:
    """Requests of one kind.

    Attributes:
        name: The request and the arm.
        path: Where the requests are sent.
        bodies: They are sent one after the other.
        cost: The cost of an answer to a request, which should not grow from one version to the next.
    """

    name: str
    path: str
    bodies: tuple[bytes, ...]
    cost: Cost


def uploads() -> list[bytes]:
    """Return the arms without masses, hence without torques, as robots to add to a service."""
    return [
        orjson.dumps({"kind": "urdf", "id": _massless(arm), "urdf": plain_urdf(load_robot(arm)), "tip_frame": "tool"})
        for arm in _arms()
    ]


def kinds() -> Iterator[Kind]:
    """Yield every kind of request that is compared, always the same ones."""
    for arm in _arms():
        robot = load_robot(arm)
        for backend in BACK_ENDS:
            yield from _plans(robot, backend)
        yield from _kinematics(robot)


def _arms() -> list[str]:
    return [arm for arm in HOMES if arm in catalogue_ids()]


def _massless(arm: str) -> str:
    return f"{arm}_without_masses"


def _plans(robot: Robot, backend: dict[str, Any]) -> Iterator[Kind]:
    slow = backend["kind"] == SLOW
    variants = range(VARIANTS_OF_SLOW if slow else VARIANTS)
    lengths = [count for count in WAYPOINTS if not slow or count <= MOST_FOR_SLOW]
    for torques in (True, False):
        asked = {"robot": robot.id if torques else _massless(robot.id), "backend": backend}
        if slow:
            asked |= {"include": ["torque"]} if torques else {"backend": backend | {"objective": "jerk"}}
        cost = _effort_of(robot) if slow and torques else _duration
        for count in lengths:
            for transition in ("through", "stop"):
                lists = [_joint_waypoints(robot, count, transition, seed) for seed in variants]
                words = f"{count} joint waypoints, {transition}, {'torques' if torques else 'no torques'}"
                yield _plan_kind(robot, backend, words, asked, lists, cost)
    asked = {"robot": robot.id, "backend": backend} | ({"include": ["torque"]} if slow else {})
    cost = _effort_of(robot) if slow else _duration
    yield _plan_kind(robot, backend, "10 poses", asked, [_pose_waypoints(robot, 10, seed) for seed in variants], cost)
    lines = [_blended_lines(robot, 5, seed) for seed in variants]
    yield _plan_kind(robot, backend, "5 lines with blends", asked, lines, cost)


def _plan_kind(
    robot: Robot,
    backend: dict[str, Any],
    words: str,
    asked: dict[str, Any],
    lists: list[list[dict[str, Any]]],
    cost: Cost,
) -> Kind:
    shared = asked | {"sample_period": SAMPLE_PERIOD, "deadline": 60.0}
    bodies = tuple(orjson.dumps(shared | {"waypoints": waypoints}) for waypoints in lists)
    return Kind(f"{backend['kind']}, {words}, {robot.id}", "/v1/trajectories", bodies, cost)


def _joint_waypoints(robot: Robot, count: int, transition: str, seed: int) -> list[dict[str, Any]]:
    first, *inner, last = ({"kind": "joint", "position": q} for q in _walk(robot, count, seed).tolist())
    return [first, *(waypoint | {"transition": {"kind": transition}} for waypoint in inner), last]


def _pose_waypoints(robot: Robot, count: int, seed: int) -> list[dict[str, Any]]:
    return [{"kind": "pose", "pose": _as_json(pose)} for pose in forward_kinematics(robot, _walk(robot, count, seed))]


def _blended_lines(robot: Robot, count: int, seed: int) -> list[dict[str, Any]]:
    """Return a joint waypoint and straight lines from there, up and down along each axis by turns."""
    rng = np.random.default_rng(seed)
    moves = rng.uniform(0.5 * MOVE, MOVE, (count, 3)) * np.where(np.arange(count) % 2, 1.0, -1.0)[:, None]
    lines = [
        {
            "kind": "relative",
            "frame": "base",
            "move": {"kind": "cartesian", "translation": move},
            "motion": {"kind": "linear"},
            "transition": {"kind": "blend", "radius": BLEND},
        }
        for move in moves.tolist()
    ]
    del lines[-1]["transition"]
    return [{"kind": "joint", "position": list(HOMES[robot.id])}, *lines]


def _kinematics(robot: Robot) -> Iterator[Kind]:
    positions = _walk(robot, POSES, seed=0)
    near = positions + np.random.default_rng(1).uniform(-NEAR, NEAR, positions.shape)
    poses = [_as_json(pose) for pose in forward_kinematics(robot, positions)]
    single = [{"poses": [pose], "solutions": "best"} for pose in poses[:SINGLE_POSES]]
    many = {"poses": poses, "solutions": "best"}
    asked: dict[str, list[dict[str, Any]]] = {
        "one solution": single,
        "one solution, near reference": [
            body | {"reference": q} for body, q in zip(single, near.tolist(), strict=False)
        ],
        "one solution, far reference": [body | {"reference": list(HOMES[robot.id])} for body in single],
        "all solutions": [body | {"solutions": "all"} for body in single],
        f"{POSES} solutions": [many],
        f"{POSES} solutions, near reference": [many | {"reference": near[0].tolist()}],
    }
    for name, bodies in asked.items():
        yield _kinematics_kind(robot, name, "inverse", bodies, _way_of(robot))
    rows = positions.tolist()
    forward = {"one pose": [{"positions": [q]} for q in rows[:SINGLE_POSES]], f"{POSES} poses": [{"positions": rows}]}
    for name, bodies in forward.items():
        yield _kinematics_kind(robot, name, "forward", bodies, _distances)
    jacobians = [{"position": q} for q in rows[:SINGLE_POSES]]
    yield _kinematics_kind(robot, "Jacobian", "jacobian", jacobians, lambda _, answer: answer["manipulability"])


def _kinematics_kind(robot: Robot, name: str, path: str, bodies: list[dict[str, Any]], cost: Cost) -> Kind:
    encoded = tuple(orjson.dumps({"robot": robot.id} | body) for body in bodies)
    return Kind(f"{name}, {robot.id}", f"/v1/kinematics/{path}", encoded, cost)


def _walk(robot: Robot, count: int, seed: int) -> FloatArray:
    """Return joint positions (count, joints) about home, each near the one before."""
    rng, positions = np.random.default_rng(seed), [np.zeros(robot.dof)]
    for _ in range(count - 1):
        there = positions[-1] + rng.uniform(-STRIDE, STRIDE, robot.dof)
        positions.append(np.where(np.abs(there) > SPREAD, np.sign(there) * 2.0 * SPREAD - there, there))
    return np.array(HOMES[robot.id]) + np.array(positions)


def _as_json(pose: Pose) -> dict[str, Any]:
    assert pose.rotation is not None  # noqa: S101 - forward kinematics give one
    orientation = {"kind": "matrix", "matrix": pose.rotation.tolist()}
    return {"position": pose.position.tolist(), "orientation": orientation}


def _duration(_: Document, answer: Document) -> float:
    return float(answer["duration"])


def _effort_of(robot: Robot) -> Cost:
    """Return the integral of the squared shares of the torque limits, s, by the trapezoidal rule on the samples."""
    limits = robot.limit("torque")

    def effort(_: Document, answer: Document) -> float:
        samples = answer["samples"]
        shares = ((np.array(samples["torque"]) / limits) ** 2).sum(axis=1)
        return float(np.trapezoid(shares, samples["time"]))

    return effort


def _way_of(robot: Robot) -> Cost:
    """Return the time from the reference, if any, from solution to solution, s; and 1 for each missing one."""
    velocity = robot.limit("velocity")

    def way(request: Document, answer: Document) -> float:
        found = [result["solutions"] for result in answer["results"]]
        missing = float(sum(not solutions for solutions in found))
        positions = [solutions[0]["position"] for solutions in found if solutions]
        if not positions:
            return missing
        steps = np.diff([request.get("reference", positions[0]), *positions], axis=0) / velocity
        return float(np.linalg.norm(steps, axis=1).sum()) + missing

    return way


def _distances(_: Document, answer: Document) -> float:
    """Return the sum of the distances of the tool from the base, m."""
    return float(np.linalg.norm([pose["position"] for pose in answer["poses"]], axis=1).sum())
