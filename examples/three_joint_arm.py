"""Document 002: the three-joint arm, planned by the service over HTTP.

Run: planner serve --port 8000, then: python examples/three_joint_arm.py http://127.0.0.1:8000
"""

from __future__ import annotations

import json
import sys
from math import degrees, radians
from pathlib import Path
from typing import Any

import httpx

ROBOT = "three_dof_arm"

# Table 1.2: degrees, and the position as printed, mm. E21: the y of the first and the x, y of the last are misprinted.
TABLE_1_2 = [
    ((30, 30, 30), (222.23, 128.00, -50.00)),
    ((45, 45, 45), (170.21, 170.21, -70.71)),
    ((60, 60, 60), (110.00, 190.53, -86.60)),
    ((90, 90, 90), (0.00, 170.00, -100.00)),
    ((120, 120, 120), (-60.75, 105.22, -86.60)),
]

# Table 2.2: target, mm, and the first of its four solutions as printed, degrees.
TABLE_2_2 = [
    ((90, 90, -90), (45.0, 115.2, 115.4)),
    ((90, 150, -90), (59.0, 87.0, 90.3)),
    ((60, 150, -60), (68.2, 92.1, 105.7)),
    ((-90, 100, -140), (132.0, 107.2, 92.0)),
    ((-60, 60, -60), (135.0, 148.2, 145.7)),
]


def post(client: httpx.Client, path: str, body: dict[str, Any]) -> dict[str, Any]:
    """Return the answer; a problem document is printed and ends the script."""
    response = client.post(path, json=body)
    answer: dict[str, Any] = response.json()
    if response.is_error:
        sys.exit(f"{answer['title']}: {answer['detail']}")
    return answer


def show_forward(client: httpx.Client) -> None:
    positions = [[radians(angle) for angle in angles] for angles, _ in TABLE_1_2]
    answer = post(client, "/v1/kinematics/forward", {"robot": ROBOT, "positions": positions})
    print("Table 1.2, forward kinematics, mm (E21: first and last row are misprinted)")
    print(f"  {'degrees':>14} {'printed':>27} {'ours':>27}")
    for (angles, printed), pose in zip(TABLE_1_2, answer["poses"], strict=True):
        ours = [1000.0 * x for x in pose["position"]]
        print(f"  {angles!s:>14} {_row(printed):>27} {_row(ours):>27}")


def show_inverse(client: httpx.Client) -> None:
    print("\nTable 2.2, elbow up, degrees (E23: the first row is misprinted)")
    print(f"  {'target, mm':>16} {'printed':>27} {'ours':>27}")
    for target, printed in TABLE_2_2:
        pose = {"position": [x / 1000.0 for x in target], "orientation": None}
        body = {"robot": ROBOT, "poses": [pose], "solutions": "best", "reference": [radians(x) for x in printed]}
        (result,) = post(client, "/v1/kinematics/inverse", body)["results"]
        ours = [degrees(x) for x in result["solutions"][0]["position"]]
        print(f"  {target!s:>16} {_row(printed):>27} {_row(ours):>27}")


def show_movement_sets(client: httpx.Client) -> None:
    print("\nMovement sets: published as 10 s rest, 5 s there, 10 s rest, 5 s back (E25: in the time since each start)")
    print(f"  {'set':7} {'there':>13} {'back':>13} {'waypoint error':>15} {'continuity':>10}  certificate")
    for name in ("first", "second", "third"):
        request = json.loads(Path(__file__).with_name(f"three_joint_arm_{name}.json").read_text(encoding="utf-8"))
        answer = post(client, "/v1/trajectories", request)
        start, end, again = answer["waypoints"]
        there = f"{start['departure_time']:g} to {end['arrival_time']:g} s"
        back = f"{end['departure_time']:g} to {again['arrival_time']:g} s"
        error = f"{max(waypoint['position_error'] for waypoint in answer['waypoints']):.0e} m"
        certificate = answer["certificate"]
        verdict = "satisfied" if certificate["satisfied"] else "broken"
        print(f"  {name:7} {there:>13} {back:>13} {error:>15} {certificate['continuity']:>10}  {verdict}")


def _row(values: tuple[float, ...] | list[float]) -> str:
    return " ".join(f"{round(x, 2) + 0.0:8.2f}" for x in values)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python three_joint_arm.py SERVICE_URL")
    with httpx.Client(base_url=sys.argv[1], timeout=30.0) as client:
        show_forward(client)
        show_inverse(client)
        show_movement_sets(client)
