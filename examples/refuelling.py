"""Document 000: the refuelling robot's two case studies, planned with the library.

Run: python examples/refuelling.py
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.errors import UnreachableWaypoint
from planner.kinematics import Pose
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem, PoseWaypoint
from planner.robots import load_robot

if TYPE_CHECKING:
    from planner.plans.result import Plan

# Tables 3.2 and 3.3, degrees. Table 3.3 lost the sign of joint 5 at P3 and P4, which Table 4.9 has (E5).
JOINT_TABLES = {
    "case 1 (car)": [
        [-12, 17, 0, 0, 0, 0],
        [-19, 26, 92, 0, 0, 19],
        [-25, 26, 54, 0, 20, 25],
        [-26, 31, 57, 0, 18, 26],
        [-24, 24, 54, 0, 21, 24],
        [0, 24, 0, 0, 0, 0],
    ],
    "case 2 (bus)": [
        [-12, 17, 0, 0, 0, 0],
        [-84, 26, 92, 0, 0, 84],
        [-83, 26, 74, 0, -36, 83],
        [-85, 31, 113, 0, -78, 85],
        [0, 24, 0, 0, 0, 0],
    ],
}
DURATIONS = {"case 1 (car)": [7.33, 4.45, 3.14, 3.87, 6.5], "case 2 (bus)": [14.86, 4.94, 5.17, 12.63]}
TOTALS = {"case 1 (car)": 25.29, "case 2 (bus)": 37.60}

# Case 2, segment P1-P2, Tables 4.6 to 4.10: c2 and c3 as printed, of joints 1, 2, 3, 5, 6.
PRINTED = {1: (-0.978, 0.044), 2: (0.122, -0.005), 3: (1.250, -0.056), 5: (0.0, 0.0), 6: (1.141, -0.051)}

# Section 3.4.1: the points of case 1, m; the orientation is the identity at each.
POINTS = [
    (-1.13, 0.7, 0.2),
    (-0.8, 1.0, -0.3),
    (-0.8, 1.05, -0.3),
    (-0.8, 1.05, -0.35),
    (-0.8, 1.05, -0.28),
    (-0.8, 0.0, -0.28),
]
# E2: from each to the nearest point that Table 3.1 reaches, mm.
DISTANCES = [24.7, 9.4, 46.1, 65.3, 39.1, 79.3]


def plan_case(case: str) -> Plan:
    """Return the joint table of a case study with its published durations."""
    positions = np.radians(JOINT_TABLES[case]).tolist()
    waypoints = [JointWaypoint(position=tuple(positions[0]))]
    for q, duration in zip(positions[1:], DURATIONS[case], strict=True):
        waypoints.append(JointWaypoint(position=tuple(q), duration=duration))
    return plan(PlanningProblem(load_robot("ngv_refuelling_arm_published"), tuple(waypoints)))


def show_durations() -> Plan:
    print("Joint tables with the published durations")
    print(f"  {'case':14} {'published':>10} {'planned':>9} {'peak velocity':>14}  certificate")
    for case, total in TOTALS.items():
        result = plan_case(case)
        peak = next(check for check in result.certificate.checks if check.quantity == "velocity")
        velocity = f"{np.degrees(peak.peak):.2f} deg/s"
        verdict = "satisfied" if result.certificate.satisfied else "broken"
        print(f"  {case:14} {total:8.2f} s {result.trajectory.duration:7.2f} s {velocity:>14}  {verdict}")
    return result


def show_coefficients(bus: Plan) -> None:
    print("\nCase 2, P1-P2: printed to three decimals, and the end that the printed polynomial misses (E13)")
    print(f"  {'joint':5} {'c2 printed':>10} {'c2':>10} {'c3 printed':>10} {'c3':>10} {'misses by':>11}")
    duration = DURATIONS["case 2 (bus)"][0]
    for joint, (c2, c3) in PRINTED.items():
        ours = np.degrees(bus.trajectory.coefficients[0, joint - 1]) + 0.0
        end = JOINT_TABLES["case 2 (bus)"][0][joint - 1] + c2 * duration**2 + c3 * duration**3
        miss = end - JOINT_TABLES["case 2 (bus)"][1][joint - 1]
        print(f"  {joint:<5} {c2:10.3f} {ours[2]:10.6f} {c3:10.3f} {ours[3]:10.6f} {miss:7.2f} deg")


def show_poses() -> None:
    print("\nCase 1, the points as poses: solved on the repaired arm (E1), out of reach of the published one (E2)")
    print(f"  {'point':5} {'solutions':>9} {'error':>10} {'E2':>9} {'short by':>9}")
    repaired, published = load_robot("ngv_refuelling_arm"), load_robot("ngv_refuelling_arm_published")
    poses = [PoseWaypoint(pose=Pose(np.array(point), np.eye(3))) for point in POINTS]
    solved = plan(PlanningProblem(repaired, tuple(poses))).path.waypoints
    for i, (waypoint, distance) in enumerate(zip(solved, DISTANCES, strict=True)):
        error = f"{waypoint.position_error:.0e} m"
        position_only = PoseWaypoint(pose=Pose(poses[i].pose.position))
        try:
            plan(PlanningProblem(published, (position_only, JointWaypoint(position=(0.0,) * 6))))
        except UnreachableWaypoint as refusal:
            short = 1000.0 * refusal.nearest.position_error if refusal.nearest else float("nan")
            print(f"  P{i + 1:<4} {waypoint.solutions:>9} {error:>10} {distance:6.1f} mm {short:6.1f} mm")


if __name__ == "__main__":
    bus = show_durations()
    show_coefficients(bus)
    show_poses()
