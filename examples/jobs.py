"""Ten jobs as a cell's programmer would write them: each a request of POST /v1/trajectories, made by a few lines.

Run: python examples/jobs.py    (writes examples/jobs/*.json)
"""

from __future__ import annotations

import json
from math import cos, pi, radians, sin
from pathlib import Path
from typing import Any

JSON = dict[str, Any]

KUKA = "kuka_kr16_l6_2"

HOME = {"kind": "joint", "name": "home", "position": [0.0, -1.57, 1.57, 0.0, 1.57, 0.0]}
"""Arm folded, tool down."""

STRETCHED = {"kind": "joint", "name": "home", "position": [0.0, -1.2, 1.4, 0.0, 0.0, 0.0]}
"""Wrist stretched: joints 4 and 6 turn about the same axis, a singular joint position."""

DOWN = {"kind": "rpy", "rpy": [pi, 0.0, pi]}
"""The tool points straight down."""


def pose(position: list[float], **more: Any) -> JSON:
    """Return a waypoint where the tool points down, reached by a joint motion unless `more` says otherwise."""
    orientation = more.pop("orientation", DOWN)
    return {"kind": "pose", "pose": {"position": position, "orientation": orientation}, **more}


def line(position: list[float], **more: Any) -> JSON:
    """Return a waypoint to which the tool goes along a straight line."""
    return pose(position, motion={"kind": "linear"}, **more)


def arc(via: list[float], position: list[float], **more: Any) -> JSON:
    """Return a waypoint to which the tool goes along a circle through a third point."""
    return pose(position, motion={"kind": "circular", "via": {"position": via, "orientation": None}}, **more)


def blend(radius: float) -> JSON:
    """Cut the corner at this waypoint, from the radius before it to the radius after it."""
    return {"kind": "blend", "radius": radius}


THROUGH = {"kind": "through"}


def palletising() -> JSON:
    """Stack six boxes of 5 kg on a pallet, two by three: straight down and up, with cut corners."""
    belt, waypoints = [0.9, -0.9, 0.7], [HOME]
    for k in range(6):
        place = [1.1 + 0.25 * (k // 3), 0.3 + 0.25 * (k % 3), 0.5]
        waypoints += reach(belt, 0.25, {"mass": 5.0, "center_of_mass": [0.0, 0.0, 0.15]}, f"box {k + 1}")
        waypoints += reach(place, 0.25, None, f"place {k + 1}")
    return {"robot": KUKA, "waypoints": [*waypoints, HOME], "backend": {"kind": "toppra"}}


def reach(at: list[float], lift: float, carries: JSON | None, name: str) -> list[JSON]:
    """Return straight lines to a point and back, with half a second for the gripper at the point."""
    x, y, z = at
    above = [x, y, z + lift]
    return [
        pose(above, transition=blend(0.08)),
        line(at, name=name, dwell=0.5, payload=carries),
        line(above, transition=blend(0.08)),
    ]


def pick_and_place() -> JSON:
    """Carry a part of 4 kg from here to there within jerk limits, so that it does not swing."""
    part = {"mass": 4.0, "center_of_mass": [0.0, 0.0, 0.1]}
    waypoints = [HOME, *reach([1.2, -0.6, 0.5], 0.2, part, "pick"), *reach([1.0, 0.7, 0.6], 0.2, None, "place"), HOME]
    return {"robot": KUKA, "waypoints": waypoints, "backend": {"kind": "ruckig"}}


def machine_tending() -> JSON:
    """Leave a machine in a straight line from a stretched wrist, which is singular; then go round to the tray."""

    def move(x: float, y: float, z: float, **more: Any) -> JSON:
        shift = {"kind": "cartesian", "translation": [x, y, z]}
        return {"kind": "relative", "frame": "base", "move": shift, "motion": {"kind": "linear"}, **more}

    waypoints = [
        STRETCHED,
        move(-0.25, 0.0, 0.0, name="out", transition=blend(0.05)),
        {"kind": "joint", "position": [1.3, -1.5, 1.6, 0.0, 0.6, 0.0], "name": "above tray"},
        move(0.0, 0.0, -0.2, name="tray", dwell=1.0),
        move(0.0, 0.0, 0.2),
        STRETCHED,
    ]
    return {"robot": KUKA, "waypoints": waypoints, "backend": {"kind": "quintic"}}


def seam() -> JSON:
    """Weld a line, a tangent half circle and a line at 8 mm/s, the torch tilted by 20 degrees."""
    torch = {"kind": "rpy", "rpy": [pi, radians(20.0), pi]}
    slow = {"limits": {"tcp_linear_velocity": 0.008}, "orientation": torch}
    waypoints = [
        HOME,
        pose([1.1, -0.1, 0.7], orientation=torch),
        line([1.1, -0.1, 0.6], name="arc on", dwell=0.5, orientation=torch),
        line([1.2, -0.1, 0.6], transition=blend(0.002), **slow),
        arc([1.25, -0.05, 0.6], [1.2, 0.0, 0.6], transition=blend(0.002), **slow),
        line([1.1, 0.0, 0.6], name="arc off", dwell=0.3, **slow),
        line([1.1, 0.0, 0.7], orientation=torch),
        HOME,
    ]
    return {"robot": KUKA, "waypoints": waypoints, "backend": {"kind": "ruckig"}, "sample_period": 0.02}


def weave() -> JSON:
    """Weave a seam of forty strokes, 6 mm across and 2 mm on, corners cut, at 15 mm/s."""
    strokes = [[1.1 + 0.002 * k, 0.2 + 0.003 * (-1) ** k, 0.6] for k in range(40)]
    slow = {"limits": {"tcp_linear_velocity": 0.015}, "transition": blend(0.0008)}
    waypoints = [
        pose([1.1, 0.2, 0.7]),
        line(strokes[0]),
        *(line(at, **slow) for at in strokes[1:-1]),
        line(strokes[-1]),
    ]
    return {"robot": KUKA, "waypoints": waypoints, "backend": {"kind": "trapezoidal"}}


def gluing() -> JSON:
    """Apply a bead of glue around a lid, a rectangle with round corners, at 150 mm/s without a stop."""
    x, y, z, a, b, r = 1.2, 0.0, 0.6, 0.2, 0.12, 0.04
    sides, corner = [], r * (1.0 - cos(pi / 4.0))
    for sx, sy, first in ((1, -1, "x"), (1, 1, "y"), (-1, 1, "x"), (-1, -1, "y")):
        ends = [[x + sx * (a - r), y + sy * b, z], [x + sx * a, y + sy * (b - r), z]]
        start, end = ends if first == "x" else ends[::-1]
        middle = [x + sx * (a - corner), y + sy * (b - corner), z]
        sides += [line(start, transition=blend(0.01)), arc(middle, end, transition=blend(0.01))]
    begin = [x, y - b, z]
    waypoints = [pose([x, y - b, z + 0.1]), line(begin, name="glue on"), *sides, line(begin, name="glue off")]
    limits = {"tcp_linear_velocity": 0.15}
    return {"robot": KUKA, "waypoints": waypoints, "backend": {"kind": "ruckig"}, "limits": limits}


def deburring() -> JSON:
    """Deburr an edge that a CAM program gives as 120 points, each corner cut by 2 mm, at 50 mm/s."""
    angles = [2.0 * pi * k / 120 for k in range(121)]
    edge = [[1.2 + 0.15 * cos(t) * (1.0 + 0.1 * cos(3.0 * t)), 0.25 * sin(t), 0.6] for t in angles]
    waypoints = [pose([edge[0][0], edge[0][1], 0.7]), line(edge[0])]
    waypoints += [line(at, transition=blend(0.002)) for at in edge[1:-1]] + [line(edge[-1])]
    limits = {"tcp_linear_velocity": 0.05}
    return {"robot": KUKA, "waypoints": waypoints, "backend": {"kind": "toppra"}, "limits": limits}


def spraying() -> JSON:
    """Spray a panel in six passes at 400 mm/s; the turns outside the panel are blended."""
    waypoints = [HOME]
    for k in range(6):
        ends = [[1.0 + 0.08 * k, side, 0.8] for side in (-0.5, 0.5)]
        waypoints += [line(at, transition=blend(0.035)) for at in (ends if k % 2 == 0 else ends[::-1])]
    waypoints[1] = pose([1.0, -0.5, 0.8], name="spray on")
    waypoints[-1] = line(waypoints[-1]["pose"]["position"], name="spray off")
    limits = {"tcp_linear_velocity": 0.4}
    return {"robot": KUKA, "waypoints": [*waypoints, HOME], "backend": {"kind": "trapezoidal"}, "limits": limits}


def screwdriving() -> JSON:
    """Drive four screws: approach quickly, go 20 mm down at 10 mm/s, tighten for a second, retract."""
    waypoints = [HOME]
    for k, (x, y) in enumerate([(1.1, -0.15), (1.1, 0.15), (1.3, 0.15), (1.3, -0.15)]):
        slow = {"limits": {"tcp_linear_velocity": 0.01}, "dwell": 1.0}
        waypoints += [pose([x, y, 0.56]), line([x, y, 0.54], name=f"screw {k + 1}", **slow), line([x, y, 0.56])]
    return {"robot": KUKA, "waypoints": [*waypoints, HOME], "backend": {"kind": "auto"}}


def inspection() -> JSON:
    """Inspect seven points of a car body with a camera on its way; its orientation is free."""
    places = [[1.0 + 0.1 * sin(k), -0.6 + 0.2 * k, 0.8 + 0.1 * cos(2.0 * k)] for k in range(7)]
    waypoints = [HOME, *(pose(at, orientation=None, transition=THROUGH) for at in places), HOME]
    return {"robot": KUKA, "waypoints": waypoints, "backend": {"kind": "min_effort"}}


JOBS = (
    palletising,
    pick_and_place,
    machine_tending,
    seam,
    weave,
    gluing,
    deburring,
    spraying,
    screwdriving,
    inspection,
)


def text(request: JSON) -> str:
    """Return a request as text: one line for each waypoint, numbers to a micrometre."""
    rounded = json.loads(json.dumps(request), parse_float=lambda number: round(float(number), 6))
    waypoints = rounded.pop("waypoints")
    head = json.dumps(rounded, indent=2).removesuffix("\n}")
    lines = ",\n".join("    " + json.dumps(waypoint) for waypoint in waypoints)
    return f'{head},\n  "waypoints": [\n{lines}\n  ]\n}}\n'


def main() -> None:
    folder = Path(__file__).with_suffix("")
    folder.mkdir(exist_ok=True)
    for job in JOBS:
        (folder / f"{job.__name__}.json").write_text(text(job()), encoding="utf-8")


if __name__ == "__main__":
    main()
