"""Trajectories for the tests of operations, and their evaluation by scipy."""

from __future__ import annotations

from functools import cache

import numpy as np
import ruckig
from scipy.interpolate import PPoly

from planner.backends import BACKENDS
from planner.operations import JointState
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.transitions import ThroughTransition
from planner.robots import Robot, load_robot
from planner.spatial import FloatArray
from planner.trajectories.trajectory import Trajectory

KUKA = "kuka_kr16_2"


def kuka() -> Robot:
    return load_robot(KUKA)


@cache
def planned(kind: str) -> Trajectory:
    """Plan a motion from rest to rest that passes one waypoint and rests at the next."""
    waypoints = [
        JointWaypoint((0.0, -1.5, 1.5, 0.0, 0.5, 0.0)),
        JointWaypoint((0.4, -1.3, 1.2, 0.1, 0.5, 0.5), transition=ThroughTransition()),
        JointWaypoint((0.9, -1.2, 1.3, 0.2, 0.4, 0.5), dwell=0.2),
        JointWaypoint((0.5, -1.4, 1.4, 0.0, 0.3, 0.1)),
    ]
    return plan(PlanningProblem(kuka(), tuple(waypoints)), BACKENDS[kind]()).trajectory


def by_scipy(trajectory: Trajectory, times: FloatArray, order: int = 0) -> FloatArray:
    """Return derivatives (N, joints) of a trajectory at times (N,), by scipy's piecewise polynomials."""
    breakpoints = np.concatenate([[0.0], np.cumsum(trajectory.lengths)])
    curve = PPoly(trajectory.coefficients.transpose(2, 0, 1)[::-1], breakpoints)
    return np.asarray(curve(times, order))


def inner_times(trajectory: Trajectory, count: int = 400) -> FloatArray:
    """Return times away from breakpoints, where derivatives may jump."""
    return (np.arange(count) + 0.5123) * trajectory.duration / count


def fastest_by_ruckig(robot: Robot, state: JointState) -> list[float]:
    """Return each joint's stopping time by Ruckig's velocity interface, which has no position limits."""
    requested = ruckig.InputParameter(robot.dof)
    requested.control_interface = ruckig.ControlInterface.Velocity
    requested.synchronization = ruckig.Synchronization.No
    requested.current_position, requested.current_velocity = state.position, state.velocity
    requested.current_acceleration = state.acceleration
    requested.target_velocity = requested.target_acceleration = np.zeros(robot.dof)
    for quantity in ("velocity", "acceleration", "jerk"):
        setattr(requested, f"max_{quantity}", robot.limit(quantity))
    found = ruckig.Trajectory(robot.dof)
    ruckig.Ruckig(robot.dof).calculate(requested, found)
    return list(found.independent_min_durations)
