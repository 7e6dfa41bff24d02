"""Why a motion of the tool cannot be followed."""

from __future__ import annotations

import numpy as np

from planner.errors import ConfigurationChange, JointPositionLimit, PlanningError, SingularPath, UnreachableWaypoint
from planner.kinematics.forward import jacobian
from planner.kinematics.inverse import inverse_kinematics
from planner.kinematics.options import InverseKinematicsOptions
from planner.problems.problem import Singularity
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.tool_motions.follow import SINGULAR_TRAVEL, Lost
from planner.tool_motions.pose_paths import PosePath
from planner.trajectories.polynomials import PiecewisePolynomial
from planner.trajectories.trajectory import PlanWarning

LOOK_AHEAD = 2e-3
"""The share of the way behind the point where the arm got stuck, at which the path is tried for reachability."""

LOOKS_AHEAD = 8
"""The number of poses on the rest of the way that are tried for it, too."""

SINGULAR_TRAVEL_SLOWED = 1e7
"""The same as `SINGULAR_TRAVEL` where the tool may be slowed down as much as it takes.

More, and rounding decides where the joint is.
"""

WORTH_A_WARNING = 100.0
"""Travel of a joint, rad or m, for 1 m or 1 rad of the tool above which a warning says so.

With a joint at 3 rad/s, the tool moves at 30 mm/s.
"""

LEAST_TOOL_TRAVEL = 1e-9
"""The smallest motion of the tool, m and rad, by which that of a joint is divided."""


def limit_error(name: str, robot: Robot, u: float, position: FloatArray, joint: int) -> JointPositionLimit:
    """Build the refusal of a motion that reaches a position limit of a joint at u, at a position (joints,)."""
    lower, upper = robot.limit("lower")[joint], robot.limit("upper")[joint]
    value, limited = float(position[joint]), robot.joint_names[joint]
    limit = float(lower if value < (lower + upper) / 2.0 else upper)
    return JointPositionLimit(
        f"{name} takes {limited} beyond its limit {limit:.6g} after {u:.1%} of the way",
        joint=limited,
        value=value,
        limit=limit,
    )


def lost_error(
    name: str,
    robot: Robot,
    path: PosePath,
    lost: Lost,
    options: InverseKinematicsOptions,
    singularity: Singularity,
) -> PlanningError:
    """Build the refusal of a motion that the joints cannot follow further: out of reach, or a singularity."""
    where = f"after {lost.u:.1%} of the way" if lost.u > 0.0 else "at its start"
    ahead = min(1.0, lost.u + LOOK_AHEAD)
    for u in (ahead, *np.linspace(ahead, 1.0, LOOKS_AHEAD + 1)[1:].tolist()):
        if inverse_kinematics(robot, path.pose(u), options, lost.position).status == "unreachable_waypoint":
            where = where if u == ahead else f"before {u:.1%} of the way"
            return UnreachableWaypoint(f"{name} leaves what {robot.id} can reach {where}")
    idle = np.linalg.svd(jacobian(robot, lost.position))[2][min(robot.dof, 6) - 1]  # at the singularity it is no motion
    joint = robot.joint_names[int(np.argmax(np.abs(idle)))]
    steepest = SINGULAR_TRAVEL_SLOWED if singularity == "slow" else SINGULAR_TRAVEL
    far = f"would have to jump, or go further than {steepest:g} rad (or m) for 1 m or 1 rad of the tool"
    return SingularPath(f"{name} meets a singularity {where}, where {joint} {far}", joint=joint)


def configuration_error(name: str, robot: Robot, reached: FloatArray, given: FloatArray) -> ConfigurationChange:
    """Build the refusal of a motion that ends at a joint position (joints,) other than the given one (joints,)."""
    joint = int(np.argmax(np.abs(reached - given)))
    turned = robot.joint_names[joint]
    return ConfigurationChange(
        f"{name} ends in another configuration than the requested one: "
        f"{turned} at {reached[joint]:.6g} instead of {given[joint]:.6g}",
        joint=turned,
        value=float(reached[joint]),
    )


def singularity_warning(
    name: str, robot: Robot, path: PosePath, curve: PiecewisePolynomial, angle: float
) -> PlanWarning | None:
    """Return the warning of a motion through a singularity or near one."""
    if angle > 0.0:
        how = "goes right through a singularity of the wrist"
        return PlanWarning("orientation_deviates", f"{name} {how}, for which it turns off by {angle:.3g} rad")
    rates = np.abs(curve.coefficients[:, :, 1]) / max(float(np.abs(path.twist(0.0)).max()), LEAST_TOOL_TRAVEL)
    knot, joint = np.unravel_index(rates.argmax(), rates.shape)
    if rates[knot, joint] < WORTH_A_WARNING:
        return None
    message = (
        f"{name} passes near a singularity after {curve.breakpoints[knot]:.1%} of the way: for 1 m or 1 rad "
        f"of the tool {robot.joint_names[joint]} goes {rates[knot, joint]:.3g}, so the tool has to go slowly"
    )
    return PlanWarning("near_singularity", message)
