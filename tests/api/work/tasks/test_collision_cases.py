"""Requests in collisions that were judged from outside, with their robots uploaded, against dense samples."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from planner.scene import SceneObject
from planner.shapes import Box, Cylinder
from planner.spatial import FloatArray, Pose, rotation_from_quaternion
from tests.locations import ROOT
from tests.planner.scene.brute_force import point_distance

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.api.conftest import RunningService

PLAN, ROBOTS = "/v1/trajectories", "/v1/robots"
QUARTER = np.pi / 2.0
UR10E = [
    (0.1807, 0.0, QUARTER, 0.09),
    (0.0, -0.6127, 0.0, 0.075),
    (0.0, -0.57155, 0.0, 0.06),
    (0.17415, 0.0, QUARTER, 0.05),
    (0.11985, 0.0, -QUARTER, 0.05),
    (0.11655, 0.0, 0.0, 0.045),
]
"""The offset d and the length a, m, the twist, rad, as the maker publishes them, and the radius of each link, m."""

DENSE = 200
"""Number of checked times of a trajectory."""

SPACING = 0.009
"""The largest distance between points of a box, m: less than the thickness of a wall."""

LINE = 200
"""Number of checked places along a straight line of the tool."""


def case(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((ROOT / "tests/data/collisions" / f"{name}.json").read_text(encoding="utf-8"))
    return found


def urdf() -> str:
    """Return the UR10e with a cylinder along each offset and each length of its table."""
    parts, before = ['<robot name="arm"><link name="base_link"/>'], 'xyz="0 0 0"'
    for k, (d, a, alpha, radius) in enumerate(UR10E):
        shapes = ""
        for length, origin in ((d, f'xyz="0 0 {d / 2}"'), (a, f'xyz="{a / 2} 0 {d}" rpy="0 {QUARTER} 0"')):
            if length:
                cylinder = f'<geometry><cylinder radius="{radius}" length="{abs(length)}"/></geometry>'
                shapes += f"<collision><origin {origin}/>{cylinder}</collision>"
        parent = f"link_{k}" if k else "base_link"
        parts.append(
            f'<link name="link_{k + 1}">{shapes}</link><joint name="joint_{k + 1}" type="revolute">'
            f'<parent link="{parent}"/><child link="link_{k + 1}"/><origin {before}/><axis xyz="0 0 1"/>'
            '<limit lower="-6.283" upper="6.283" velocity="2" effort="150"/></joint>'
        )
        before = f'xyz="{a} 0 {d}" rpy="{alpha} 0 0"'
    flange = f'<parent link="link_6"/><child link="tool0"/><origin {before}/>'
    return "".join([*parts, f'<link name="tool0"/><joint name="flange" type="fixed">{flange}</joint></robot>'])


@pytest.fixture
def ur10e(service: RunningService) -> Iterator[None]:
    """Upload the arm that the requests name."""
    answer = service.post(ROBOTS, {"kind": "urdf", "id": "ur10e_true", "urdf": urdf(), "tip_frame": "tool0"})
    assert answer.status_code == 201, answer.text
    yield
    service.client.delete(f"{ROBOTS}/ur10e_true")


def placed(thing: dict[str, Any]) -> Pose:
    pose = thing.get("pose") or {"position": [0.0, 0.0, 0.0]}
    turn = pose.get("orientation")
    return Pose(pose["position"], np.eye(3) if turn is None else rotation_from_quaternion(np.array(turn["xyzw"])))


def solid(thing: dict[str, Any]) -> SceneObject:
    shape = thing["shape"]
    is_box = shape["kind"] == "box"
    made = Box(shape["size"]) if is_box else Cylinder(shape["radius"], shape["length"])
    return SceneObject(thing["id"], [made], placed(thing))


def points_inside(shape: dict[str, Any]) -> tuple[FloatArray, float]:
    """Return points (N, 3) of a shape, and the radius, m, of balls around them inside the shape."""
    if shape["kind"] == "cylinder":
        half = max(shape["length"] / 2.0 - shape["radius"], 0.0)
        z = np.linspace(-half, half, 30)
        return np.stack([0.0 * z, 0.0 * z, z], axis=1), min(shape["radius"], shape["length"] / 2.0)
    axes = [np.linspace(-size / 2.0, size / 2.0, int(size / SPACING) + 2) for size in shape["size"]]
    return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3), 0.0


def frames(position: FloatArray) -> list[FloatArray]:
    """Return the frames (4, 4) behind each turn about z, and the flange, by the table."""
    found, frame = [], np.eye(4)
    for q, (d, a, alpha, _) in zip(position, UR10E, strict=True):
        c, s, ca, sa = np.cos(q), np.sin(q), np.cos(alpha), np.sin(alpha)
        found.append(frame @ np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]))
        frame = found[-1] @ np.array([[1, 0, 0, a], [0, ca, -sa, 0], [0, sa, ca, d], [0, 0, 0, 1]])
    return [*found, frame]


def least_distance(request: dict[str, Any], polynomials: list[dict[str, Any]]) -> float:
    """Return the least distance of the arm's and the tool's inner balls from the objects, m."""
    bodies: list[tuple[int, FloatArray, float]] = []
    for k, (d, a, _, radius) in enumerate(UR10E):
        for start, end in (([0.0, 0.0, 0.0], [0.0, 0.0, d]), ([0.0, 0.0, d], [a, 0.0, d])):
            length = float(np.linalg.norm(np.subtract(end, start)))
            if length > 2.0 * radius and k > 0:  # the first link stands on the floor
                shares = np.linspace(radius / length, 1.0 - radius / length, 60)[:, None]
                bodies.append((k, np.array(start) + shares * np.subtract(end, start), radius))
    for thing in request["scene"]["attached"]:
        points, radius = points_inside(thing["shape"])
        pose = placed(thing)
        held = points @ np.asarray(pose.rotation).T + pose.position + request["tool"]["position"]
        bodies.append((6, held, radius))
    objects = [point_distance(solid(thing)) for thing in request["scene"]["objects"]]
    times = np.linspace(0.0, polynomials[0]["breakpoints"][-1], DENSE)
    least = np.inf
    for row in np.stack([values_of(curve, times) for curve in polynomials], axis=1):
        turned = frames(row)
        for number, points, radius in bodies:
            here = points @ turned[number][:3, :3].T + turned[number][:3, 3]
            least = min(least, *(float(distance(here).min()) - radius for distance in objects))
    return float(least)


def values_of(curve: dict[str, Any], times: FloatArray) -> FloatArray:
    breakpoints, coefficients = np.array(curve["breakpoints"]), np.array(curve["coefficients"])
    pieces = np.clip(np.searchsorted(breakpoints, times, side="right") - 1, 0, len(coefficients) - 1)
    local = times - breakpoints[pieces]
    powers = local[:, None] ** np.arange(coefficients.shape[1])
    return np.asarray((coefficients[pieces] * powers).sum(axis=1))


@pytest.mark.large_only
@pytest.mark.usefixtures("ur10e")
def test_goal_region_is_planned_clear_of_the_bin(service: RunningService) -> None:
    """It was refused, though the same pose without `free` was planned."""
    request = case("goal_region") | {"include": ["polynomials"], "deadline": 60.0}
    answer = service.post(PLAN, request)
    assert answer.status_code == 200, answer.text
    assert answer.json()["certificate"]["satisfied"]
    assert least_distance(request, answer.json()["polynomials"]) > request["scene"]["margin"] - 1e-5


@pytest.mark.large_only
@pytest.mark.usefixtures("ur10e")
def test_bin_p00_is_refused_since_no_turn_of_the_palm_has_room(service: RunningService) -> None:
    """The part lies 50 mm from two walls in a corner. A palm of 140 mm by 50 mm needs more room in every turn."""
    request = case("bin_p00")
    (palm,) = (thing["shape"]["size"] for thing in request["scene"]["attached"] if thing["id"] == "palm")
    walls = {thing["id"]: thing for thing in request["scene"]["objects"]}
    x, y, _ = walls["p00"]["pose"]["position"]
    room_x = x - walls["bin_w"]["pose"]["position"][0] - walls["bin_w"]["shape"]["size"][0] / 2.0
    room_y = y - walls["bin_s"]["pose"]["position"][1] - walls["bin_s"]["shape"]["size"][1] / 2.0
    turns = np.linspace(0.0, 2.0 * np.pi, 3601)
    c, s = np.abs(np.cos(turns)), np.abs(np.sin(turns))
    beyond = np.maximum(palm[0] * c + palm[1] * s - 2.0 * room_x, palm[0] * s + palm[1] * c - 2.0 * room_y)
    assert beyond.min() > 0.01

    refused = service.post(PLAN, request | {"deadline": 60.0})
    assert (refused.status_code, refused.json()["code"]) == (422, "collision")


@pytest.mark.large_only
def test_segment_numbers_are_those_of_the_request(service: RunningService) -> None:
    """The corners of the detour before counted as waypoints. The nozzle meets a clamp on the line to waypoint 3."""
    request = case("segment_numbers")
    parts = {thing["id"]: thing for key in ("objects", "attached") for thing in request["scene"][key]}
    points, radius = points_inside(parts["nozzle"]["shape"])
    held = placed(parts["nozzle"])
    near = {}
    for segment in (1, 2, 3):
        start, end = (placed(request["waypoints"][k]) for k in (segment, segment + 1))
        on_line = (np.asarray(start.rotation) @ (np.asarray(held.rotation) @ points.T + held.position[:, None])).T
        tools = np.linspace(start.position, end.position, LINE)
        places = (tools[:, None] + on_line).reshape(-1, 3)
        near[segment] = min(
            float(point_distance(solid(parts[name]))(places).min()) for name in parts if "clamp" in name
        )
    assert near[2] < radius
    assert near[1] > radius

    refused = service.post(PLAN, request | {"robot": "kuka_kr16_2", "deadline": 60.0}).json()
    assert (refused["code"], refused["segment"]) == ("collision", 2)
    assert "from waypoint 2 to 3" in refused["detail"]
    assert refused["pair"][0] == "nozzle"
