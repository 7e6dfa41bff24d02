"""Document 004: the date-sorting arm: its test points, static torques and trapezoid, with the library.

Run: python examples/date_sorting.py
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.backends import Trapezoidal
from planner.dynamics import inverse_dynamics
from planner.kinematics import FloatArray, Pose, forward_kinematics
from planner.kinematics.options import InverseKinematicsOptions
from planner.planning import plan
from planner.problems.problem import PlanningProblem, PoseWaypoint
from planner.robots import load_robot
from planner.robots.payload import Payload

if TYPE_CHECKING:
    from planner.plans.result import Plan

ROBOT = load_robot("date_sorting_arm")

# Table 2: theta1, l1, l2, theta2, theta3, theta4 (degrees, mm), and the position as printed, mm.
POINTS = [
    ((0, 250, 0, 0, 90, 0), (-150, 150, 1050)),
    ((0, 250, 250, 90, 90, 0), (0, 400, 1200)),
    ((180, 500, 500, 0, 0, 0), (0, -800, 1300)),
    ((180, 500, 500, 90, 90, 180), (0, -650, 1450)),
    ((180, 0, 0, 270, 0, 180), (0, -300, 800)),
]

# Section 7 for T = 30 s, t1 = 10 s: time, s, and its first derivative.
TRAPEZOID = [
    (0, 0.0, 0.0),
    (5, 0.0625, 0.025),
    (10, 0.25, 0.05),
    (15, 0.5, 0.05),
    (20, 0.75, 0.05),
    (25, 0.9375, 0.025),
    (30, 1.0, 0.0),
]


def joints(row: tuple[int, ...]) -> FloatArray:
    """Return the joint positions, rad and m."""
    return np.where(ROBOT.is_angle, np.radians(row), np.array(row) / 1000.0)


def show_points() -> None:
    print("Table 2, position in mm, and the torques that hold 1 kg there (E31: the text has theta2 and theta3 swapped)")
    print(f"  {'point':5} {'printed':>18} {'ours':>27} {'l1':>8} {'theta2':>12} {'theta3':>12}")
    q = np.array([joints(row) for row, _ in POINTS])
    torques = inverse_dynamics(ROBOT.with_payload(Payload(mass=1.0)), q, np.zeros_like(q), np.zeros_like(q))
    for i, (pose, torque) in enumerate(zip(forward_kinematics(ROBOT, q), torques, strict=True)):
        ours = " ".join(f"{x:8.2f}" for x in np.round(1000.0 * pose.position, 2) + 0.0)
        _, force, _, theta2, theta3, _ = np.round(torque, 4) + 0.0
        print(f"  {i + 1:<5} {POINTS[i][1]!s:>18} {ours:>27} {force:6.2f} N {theta2:8.4f} N m {theta3:8.4f} N m")


def transition(start: Pose, end: Pose, duration: float, backend: Trapezoidal) -> Plan:
    """Return a transition from the branch of test point 1 (theta3 > 0)."""
    waypoints = (PoseWaypoint(pose=start), PoseWaypoint(pose=end, duration=duration))
    options = InverseKinematicsOptions(reference=tuple(joints(POINTS[0][0]).tolist()))
    return plan(PlanningProblem(ROBOT, waypoints, inverse_kinematics=options), backend)


def progress(result: Plan, time: float) -> tuple[float, float]:
    """Return s and its derivative: the fraction of the longest joint travel covered."""
    start, end = result.path.positions
    joint = int(np.argmax(np.abs(end - start)))
    position, velocity = result.trajectory.evaluate(np.array([time]), [0, 1])
    travel = end[joint] - start[joint]
    return float((position[0, joint] - start[joint]) / travel), float(velocity[0, joint] / travel)


def show_transitions() -> None:
    first, second = forward_kinematics(ROBOT, np.array([joints(row) for row, _ in POINTS[:2]]))
    trapezoid = Trapezoidal(acceleration_time=10.0)
    result = transition(first, second, 30.0, trapezoid)
    print("\nTransition 1, test point 1 to 2: s and ds/dt, published and ours")
    for time, s, speed in TRAPEZOID:
        ours, our_speed = progress(result, float(time))
        print(f"  {time:3} s   {s:8.4f} {ours:8.4f}   {speed:7.3f} {our_speed:7.3f} 1/s")
    start, end = Pose(np.array([0.5, 0.5, 1.0])), Pose(np.array([0.786, 0.0, 1.022]))
    result = transition(start, end, 30.0, trapezoid)
    worst = max(waypoint.position_error for waypoint in result.path.waypoints)
    print("\nTransition 2, by position, for its orientation is not published (E33)")
    print(f"  {result.trajectory.duration:g} s, waypoint error {worst:.0e} m")

    a = 1.0 / (0.5 * 2.0**2 + 2.0 * 7.0 + 0.5 * (2.0 * 2.0 - 1.0) * 1.0)
    result = transition(first, second, 10.0, Trapezoidal(acceleration_time=2.0, deceleration_time=1.0))
    s, speed = progress(result, 10.0)
    print("\nE33: with T = 10, t1 = 2, t2 = 9 s the document's formula ends at speed; ours ends at rest")
    print(f"  document {a * 2.0 - a * 1.0:.3f} 1/s   ours {abs(speed):.3f} 1/s at s = {s:g}")


if __name__ == "__main__":
    show_points()
    show_transitions()
