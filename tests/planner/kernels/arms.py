"""Arms and states of their joints, to compare kernels with other libraries."""

from __future__ import annotations

from functools import cache

import numpy as np

from planner.kernels.kinematics import Arm
from planner.kinematics.screws import screws_of
from planner.robots import ExternalAxis, Robot, load_robot
from planner.robots.payload import Payload
from planner.spatial import Pose, rotation_x
from planner.trajectories.polynomials import PiecewisePolynomial, quintic_hermite


@cache
def robots() -> dict[str, Robot]:
    """Return arms that turn and slide, on rails, loaded, on a wall, and with locked joints."""
    kuka = load_robot("kuka_kr16_2")
    payload = Payload(4.0, (0.05, -0.02, 0.1), (0.02, 0.03, 0.01))
    rail = ExternalAxis("rail", "prismatic", np.array([0.0, 1.0, 0.0]), lower=-2.0, upper=2.0, velocity=1.0)
    return {
        "kuka": kuka,
        "slides": load_robot("date_sorting_arm"),
        "loaded": kuka.with_payload(payload),
        "on a wall": kuka.derived(mounting=Pose(np.zeros(3), rotation_x(1.3))),
        "on a rail": kuka.with_payload(payload).derived(external_axes=[rail]),
        "locked": kuka.derived(locked={kuka.joint_names[2]: 0.4}),
    }


def random_states(robot: Robot, count: int, size: float = 3.0) -> np.ndarray:
    """Return positions, velocities and accelerations, (3, count, joints)."""
    return np.random.default_rng(count).uniform(-size, size, (3, count, robot.dof))


def quintics(robot: Robot, seed: int, pieces: int = 4, way: float = 1.0, seconds: float = 0.8) -> PiecewisePolynomial:
    """Make quintic pieces through random states."""
    rng = np.random.default_rng(seed)
    states = tuple(rng.uniform(-way, way, (3, pieces + 1, robot.dof)) * np.array([1.0, 2.0, 8.0])[:, None, None])
    lengths = seconds * rng.uniform(0.2, 1.0, pieces)
    starts, ends = (tuple(state[rows] for state in states) for rows in (slice(-1), slice(1, None)))
    return PiecewisePolynomial(lengths, quintic_hermite(lengths, starts, ends))


def arm_of(robot: Robot) -> Arm:
    """Return an arm and the origin of its tool in the form for kernels."""
    return Arm(screws_of(robot).frames, robot.tool_in_tip.translation)
