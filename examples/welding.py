"""Document 001: eleven points of a weld, from ten moves relative to the tool, planned with the library.

Run: python examples/welding.py
"""

from __future__ import annotations

from math import radians

import numpy as np

from planner.backends import Quintic
from planner.kinematics import Pose
from planner.planning import plan
from planner.problems.moves import CartesianMove, CylindricalMove, Move, SphericalMove
from planner.problems.problem import PlanningProblem, PoseWaypoint, RelativeWaypoint
from planner.robots import load_robot

HOME = PoseWaypoint(name="home", pose=Pose(np.array([0.0, 1.0, 1.3]), np.eye(3)))

# Section III.B: the parameters are right where the printed matrices of moves 7-8 (E14) and 9-10 (E15) are not.
MOVES: list[Move] = [
    CylindricalMove(r=0.17, alpha=radians(50), l=-0.5),
    CartesianMove((-0.34, 0.0, 0.0)),
    SphericalMove(r=0.2, beta=radians(23), gamma=radians(27)),
    CartesianMove((0.0, 0.17, 0.0)),
    SphericalMove(r=0.0, beta=radians(40), gamma=radians(32)),
    CartesianMove((0.34, 0.0, 0.0)),
    SphericalMove(r=0.0, beta=radians(-34), gamma=radians(-35)),
    CartesianMove((0.0, -0.17, 0.0)),
    SphericalMove(r=0.22, beta=radians(-43), gamma=radians(17)),
    CartesianMove((0.0, 0.0, -0.12)),
]

# The points as printed, m. From 9 on they carry the misprinted rotations of E14 and E15.
PRINTED = [
    (0.0, 1.0, 1.3),
    (0.1093, 1.1302, 0.8),
    (-0.1093, 0.8698, 0.8),
    (-0.0917, 0.9459, 0.9841),
    (-0.2573, 0.9841, 0.9841),
    (-0.2573, 0.9841, 0.9841),
    (-0.3655, 1.1293, 0.697),
    (-0.3655, 1.1293, 0.697),
    (-0.2661, 1.2105, 0.5858),
    (-0.3062, 1.1699, 0.7526),
    (-0.3006, 1.0409, 0.7042),
]


def main() -> None:
    relative = tuple(RelativeWaypoint(frame="tool", move=move) for move in MOVES)
    result = plan(PlanningProblem(load_robot("welding_arm"), (HOME, *relative)), Quintic())
    print("Points from the moves, m")
    print(f"  {'point':5} {'printed':>26} {'ours':>26} {'apart':>9} {'error':>9} {'arrives':>9}")
    for i, (waypoint, printed) in enumerate(zip(result.path.waypoints, PRINTED, strict=True)):
        ours = waypoint.pose.position
        apart = 1000.0 * np.linalg.norm(ours - printed)
        error = f"{waypoint.position_error:.0e} m"
        arrives = result.trajectory.arrivals[i]
        print(f"  {i + 1:<5} {_row(printed):>26} {_row(ours):>26} {apart:6.1f} mm {error:>9} {arrives:7.2f} s")
    print("  Points 9 to 11 are printed from matrices that are no rotations (E14, E15); E16 has the right ones.")
    print(f"\n{result.trajectory.duration:.2f} s as fast as the limits allow; shares of the limits:")
    for check in result.certificate.checks:
        if check.ratio is not None:
            print(f"  {check.quantity:12} {check.joint}  {check.ratio:6.1%}")


def _row(position: np.ndarray | tuple[float, ...]) -> str:
    return " ".join(f"{x:8.4f}" for x in position)


if __name__ == "__main__":
    main()
