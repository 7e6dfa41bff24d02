"""A robot among the objects of a request's scene: least distances by dense samples of its motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pinocchio as pin

from planner.shapes import Box, Capsule, Cylinder, Shape, Sphere
from planner.shapes.hulls import ConvexHull
from tests.api.random_requests.distances import CLOSED_FORMS, Distance, core_of, distance_to
from tests.api.random_requests.poses import in_base, placement, thing_at

if TYPE_CHECKING:
    from planner.robots import Robot
    from tests.api.random_requests.answered import Answered

BESIDE_MOVING = 80
"""Number of times at which moving bodies are checked against objects that move by themselves."""

COARSE = 40
"""Number of times at which moving bodies are checked against fixed objects."""

FINE = 21
"""Number of times around the nearest one in each of two refinements of the nearest pairs."""

ROOM_ON_THE_WAY = 1e-4
"""Permitted approach of an object beyond its pick or place distance on the way, m, as in docs/collisions.md."""

CLOSEST = 3
"""Number of pairs that are refined."""


class Body(NamedTuple):
    """A moving body.

    Attributes:
        name: Name of the link or of the attached object.
        joint: Pinocchio's number of the joint that carries it.
        points: (P, 3), of its core in the joint's frame, m.
        radius: Radius around its core, m.
        is_line: Whether the core is the line from the first point to the last.
        margin: Its own margin, m.
    """

    name: str
    joint: int
    points: np.ndarray
    radius: float
    is_line: bool
    margin: float = 0.0


class Thing(NamedTuple):
    """A fixed object: its name, kind, distance from points in the base frame, and margin (m)."""

    name: str
    kind: str
    distance: Distance
    margin: float


class Surroundings:
    """A robot mounted as in its request, and the scene of the request."""

    def __init__(self, robot: Robot, request: dict[str, Any]) -> None:
        scene = request.get("scene") or {}
        self.robot, self.data = robot, robot.model.createData()
        self.bodies = [
            _body(shape.link, shape.joint, shape.placement, _as_asked(shape.shape)) for shape in robot.collision_shapes
        ]
        self.links = len(self.bodies)
        self.touched: dict[str, set[str]] = {}
        for held in scene.get("attached", []):
            link = held.get("link")
            frame = robot.model.frames[robot.model.getFrameId(link or robot.tip_frame)]
            where = (
                frame.placement * (pin.SE3.Identity() if link else self._tool(request)) * placement(held.get("pose"))
            )
            body = _body(held["id"], frame.parentJoint, where, held["shape"])
            self.bodies.append(body._replace(margin=held.get("margin") or 0.0))
            self.touched[held["id"]] = {link or robot.tip_frame, *held.get("touch_links", [])}
        self.allowed = {frozenset(pair) for pair in scene.get("allowed_pairs", [])}
        self.things, self.moving = [], []
        for thing in scene.get("objects", []):
            where = thing_at(robot, request, thing, 0.0)
            margin = thing.get("margin", scene.get("margin", 0.0))
            placed = Thing(thing["id"], thing["shape"]["kind"], _placed(thing["shape"], where), margin)
            if (motion := thing.get("motion")) is None:
                self.things.append(placed)
            else:
                velocity = in_base(robot, request, thing.get("frame", "world")).rotation @ motion["velocity"]
                self.moving.append((placed, velocity, motion.get("end") or np.inf))
        self.near: dict[tuple[str, str], float] = {}

    def _tool(self, request: dict[str, Any]) -> pin.SE3:
        return placement(request["tool"]) if request.get("tool") else self.robot.tool_in_tip

    def let_near(self, joint_position: np.ndarray, moving: set[str], standing: str | None) -> None:
        """Let moving bodies approach a fixed object (None: all) as closely as at a joint position (joints,)."""
        for body in (body for body in self.bodies if body.name in moving):
            for thing in (thing for thing in self.things if standing in (None, thing.name)):
                is_exact = body.is_line and thing.kind in CLOSED_FORMS
                apart = -np.inf
                if is_exact:
                    apart = float(self.apart(body, thing, joint_position[None])[0]) - ROOM_ON_THE_WAY
                names = body.name, thing.name
                self.near[names] = min(apart, self.near.get(names, np.inf))

    def margin(self, body: Body, thing: Thing) -> float:
        """Return the least permitted distance of two objects, m; a negative one permits overlap of that depth."""
        return min(max(thing.margin, body.margin), self.near.get((body.name, thing.name), np.inf))

    def moved(self, body: Body, positions: np.ndarray) -> np.ndarray:
        """Return the core of a body (T, P, 3) in the base frame at joint positions (T, joints)."""
        return self._moved([body], positions)[0]

    def _moved(self, bodies: list[Body], positions: np.ndarray) -> list[np.ndarray]:
        rotations = np.empty((len(positions), self.robot.model.njoints, 3, 3))
        origins = np.empty((len(positions), self.robot.model.njoints, 3))
        for row, position in enumerate(positions):
            pin.forwardKinematics(self.robot.model, self.data, position)
            for joint, where in enumerate(self.data.oMi.tolist()):
                rotations[row, joint], origins[row, joint] = where.rotation, where.translation
        return [
            body.points @ rotations[:, body.joint].transpose(0, 2, 1) + origins[:, None, body.joint] for body in bodies
        ]

    def is_touching(self, body: Body, thing: Thing) -> bool:
        """Tell whether two objects are nearer than their margin where one of them is attached or detached."""
        near = self.near.get((body.name, thing.name), np.inf)
        return near + ROOM_ON_THE_WAY < max(thing.margin, body.margin)

    def least_excess(self, trajectory: Answered, ends: np.ndarray, *, touching: bool) -> tuple[float, float, str]:
        """Return the least distance minus margin of a body and an object, the least distance, and the pair.

        Of pairs that touch where something is taken or put down, or of all others. What may touch anyway is left out.
        Both are no less than the truth, between two times (2,), s.
        """
        pairs = [
            (body, thing, margin)
            for body in self.bodies
            for thing in self.things
            if body.joint and frozenset((body.name, thing.name)) not in self.allowed
            if self.is_touching(body, thing) == touching
            if (margin := self.margin(body, thing)) > -np.inf
        ]
        if not pairs:
            return np.inf, np.inf, ""
        times = np.linspace(ends[0], ends[1], COARSE)
        bodies = list({id(body): body for body, _, _ in pairs}.values())
        cores = dict(zip(map(id, bodies), self._moved(bodies, trajectory.at(times)[0]), strict=True))
        coarse = []
        for body, thing, margin in pairs:
            core = cores[id(body)]
            apart = thing.distance(core.reshape(-1, 3)).reshape(core.shape[:2]).min(axis=1) - body.radius
            coarse.append((float(apart.min()) - margin, float(times[apart.argmin()]), body, thing, margin))
        coarse.sort(key=lambda found: found[0])
        best = (np.inf, np.inf, "")
        for _, time, body, thing, margin in coarse[:CLOSEST]:
            apart = self._closely(trajectory, ends, body, thing, time)
            best = min(best, (apart - margin, apart, f"{body.name} and {thing.name}"))
        return best

    def least_beside_moving(
        self, trajectory: Answered, ends: np.ndarray, left_out: set[str]
    ) -> tuple[float, float, str]:
        """Return the least distance minus margin of a body and an object that moves, the least distance, and the pair.

        Both are no less than the truth, between two times (2,), s. Objects that are left out do not count.
        """
        best, times = (np.inf, np.inf, ""), np.linspace(ends[0], ends[1], BESIDE_MOVING)
        for body in (body for body in self.bodies if body.joint) if self.moving else ():
            core = self.moved(body, trajectory.at(times)[0])
            for thing, velocity, end in self.moving:
                if {body.name, thing.name} & left_out or frozenset((body.name, thing.name)) in self.allowed:
                    continue
                seen = core - (np.minimum(times, end)[:, None] * velocity)[:, None]
                if body.is_line:
                    apart = nearest_on_lines(seen[:, 0], seen[:, -1], thing.distance) - body.radius
                else:
                    apart = thing.distance(seen.reshape(-1, 3)).reshape(seen.shape[:2]).min(axis=1) - body.radius
                least = float(apart.min())
                best = min(best, (least - max(thing.margin, body.margin), least, f"{body.name} and {thing.name}"))
        return best

    def _closely(self, trajectory: Answered, ends: np.ndarray, body: Body, thing: Thing, time: float) -> float:
        least, step = np.inf, (ends[1] - ends[0]) / COARSE
        for _ in range(2):
            times = np.clip(time + np.linspace(-step, step, FINE), *ends)
            apart = self.apart(body, thing, trajectory.at(times)[0])
            least = min(least, float(apart.min()))
            time, step = float(times[apart.argmin()]), step / 10.0
        return least

    def speeds(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        """Return the highest speeds (T,) of a body's core at joint positions and velocities (T, joints), m/s."""
        highest = np.zeros(len(positions))
        for row, (position, velocity) in enumerate(zip(positions, velocities, strict=True)):
            pin.forwardKinematics(self.robot.model, self.data, position, velocity)
            for body in self.bodies:
                twist = self.data.v[body.joint]  # in the joint's frame, of its origin
                speeds = np.linalg.norm(twist.linear + np.cross(twist.angular, body.points), axis=1)
                highest[row] = max(highest[row], float(speeds.max()))
        return highest

    def apart(self, body: Body, thing: Thing, positions: np.ndarray) -> np.ndarray:
        """Return distances (T,) of a body from an object at joint positions (T, joints); exact for lines."""
        core = self.moved(body, positions)
        if body.is_line:
            return nearest_on_lines(core[:, 0], core[:, -1], thing.distance) - body.radius
        least: np.ndarray = thing.distance(core.reshape(-1, 3)).reshape(core.shape[:2]).min(axis=1)
        return least - body.radius

    def least_between_links(self, trajectory: Answered, sources: set[str]) -> tuple[float, str]:
        """Return the least distance of two checked links with line cores, and the names of the links."""
        kinds = [shape.source for shape in self.robot.collision_shapes]
        checked = {
            frozenset((pair.link_1, pair.link_2)) for pair in self.robot.collision_pairs if pair.reason is None
        } - self.allowed
        numbers = [k for k in range(self.links) if kinds[k] in sources and self.bodies[k].is_line]
        ends = trajectory.breakpoints[[0, -1]]
        positions = trajectory.at(np.linspace(ends[0], ends[1], COARSE))[0]
        cores = self._moved([self.bodies[k] for k in numbers], positions) if numbers else []
        best = (np.inf, "")
        for i, first in enumerate(numbers):
            for j, second in enumerate(numbers[:i]):
                a, b = self.bodies[first], self.bodies[second]
                if frozenset((a.name, b.name)) in checked:
                    from_line = _distance_from_lines(cores[j][:, 0], cores[j][:, -1])
                    apart = nearest_on_lines(cores[i][:, 0], cores[i][:, -1], from_line) - a.radius - b.radius
                    best = min(best, (float(apart.min()), f"{a.name} and {b.name}"))
        return best


def _as_asked(shape: Shape) -> dict[str, Any]:
    """Return a shape of a robot as a shape of a request."""
    match shape:
        case Sphere():
            return {"kind": "sphere", "radius": shape.radius}
        case Capsule():
            return {"kind": "capsule", "radius": shape.radius, "length": shape.length}
        case Box():
            return {"kind": "box", "size": shape.size}
        case Cylinder():
            return {"kind": "cylinder", "radius": shape.radius, "length": shape.length}
        case ConvexHull():
            return {"kind": "convex", "vertices": shape.vertices}
    raise TypeError(type(shape))


def _body(name: str, joint: int, where: pin.SE3, shape: dict[str, Any]) -> Body:
    points, radius, is_line = core_of(shape)
    return Body(name, joint, points @ where.rotation.T + where.translation, radius, is_line)


def _placed(shape: dict[str, Any], where: pin.SE3) -> Distance:
    distance = distance_to(shape)
    return lambda points: distance((points - where.translation) @ where.rotation)


def _distance_from_lines(starts: np.ndarray, ends: np.ndarray) -> Distance:
    """Return the distance of each point (N, 3) from its own line between points (N, 3)."""
    ways = ends - starts
    squares = np.maximum((ways**2).sum(axis=1), 1e-300)

    def distance(points: np.ndarray) -> np.ndarray:
        shares = np.clip(((points - starts) * ways).sum(axis=1) / squares, 0.0, 1.0)
        return np.asarray(np.linalg.norm(points - starts - shares[:, None] * ways, axis=1))

    return distance


def nearest_on_lines(starts: np.ndarray, ends: np.ndarray, distance: Distance) -> np.ndarray:
    """Return the minima (N,) of a convex function on lines between points (N, 3), by ternary search."""
    low, high = np.zeros(len(starts)), np.ones(len(starts))

    def at(share: np.ndarray) -> np.ndarray:
        return distance(starts + share[:, None] * (ends - starts))

    least: np.ndarray = np.minimum(at(low), at(high))
    if np.array_equal(starts, ends):
        return least
    for _ in range(28):
        a, b = low + (high - low) / 3.0, high - (high - low) / 3.0
        at_a, at_b = at(a), at(b)
        low, high = np.where(at_a < at_b, low, a), np.where(at_a < at_b, b, high)
        least = np.minimum(least, np.minimum(at_a, at_b))
    return least
