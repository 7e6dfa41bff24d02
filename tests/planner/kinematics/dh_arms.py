"""Denavit-Hartenberg products in full, and random arms with closed forms."""

from __future__ import annotations

import numpy as np

from planner.kinematics import FloatArray
from planner.robots import DHJoint, Robot


def rot(axis: int, angle: float) -> np.ndarray:
    T = np.eye(4)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    T[i, i] = T[j, j] = np.cos(angle)
    T[i, j], T[j, i] = -np.sin(angle), np.sin(angle)
    return T


def trans(x: float, y: float, z: float) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


def ngv_product(q: np.ndarray) -> np.ndarray:
    """Return table 3.1 of document 000, repaired (d3 = 0, d4 = 0.7), as a plain standard D-H product."""
    rows = [(0, 0.45, 90), (0, 0.68, 0), (0, 0, 90), (0.7, 0, -90), (0, 0, 90), (0, 0, 0)]
    T = np.eye(4)
    for angle, (d, a, alpha) in zip(q, rows, strict=True):
        T = T @ rot(2, angle) @ trans(a, 0, d) @ rot(0, np.radians(alpha))
    return T


Row = tuple[str, float, float, float]
"""Kind, d, a and alpha of one joint."""


def plain_product(rows: list[Row], q: FloatArray) -> FloatArray:
    T = np.eye(4)
    for (kind, d, a, alpha), value in zip(rows, q, strict=True):
        angle, offset = (0.0, d + value) if kind == "prismatic" else (value, d)
        T = T @ rot(2, angle) @ trans(a, 0, offset) @ rot(0, alpha)
    return T


def arm_of(rows: list[Row]) -> Robot:
    joints = [
        DHJoint("prismatic", d=d, a=a, alpha=alpha, lower=-2.0, upper=2.0)
        if kind == "prismatic"
        else DHJoint("continuous", d=d, a=a, alpha=alpha)
        for kind, d, a, alpha in rows
    ]
    return Robot.from_dh(joints)


def twist(rng: np.random.Generator) -> float:
    """Draw an angle between axes that are neither parallel nor nearly so."""
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(0.4, np.pi - 0.4))


def general(kind: str, rng: np.random.Generator) -> Row:
    return (kind, *rng.uniform(0.1, 0.6, 2).tolist(), twist(rng))


def spherical_wrist(rng: np.random.Generator) -> list[Row]:
    """Draw an arm whose last three axes meet at the fifth joint; half the second axes parallel the third."""
    arm = [general("continuous", rng) for _ in range(3)]
    if rng.random() < 0.5:
        arm[1] = (*arm[1][:3], 0.0)
    wrist = [("continuous", 0.3, 0.0, twist(rng)), ("continuous", 0.0, 0.0, twist(rng)), general("continuous", rng)]
    return arm + wrist


def three_parallel(rng: np.random.Generator) -> list[Row]:
    rows = [general("continuous", rng) for _ in range(6)]
    rows[1], rows[2] = (*rows[1][:3], 0.0), (*rows[2][:3], 0.0)
    rows[4] = (*rows[4][:2], 0.0, rows[4][3])
    return rows


def turn_and_slides(rng: np.random.Generator) -> list[Row]:
    rows = spherical_wrist(rng)
    return [rows[0], general("prismatic", rng), general("prismatic", rng), *rows[3:]]


def apart(q: FloatArray, other: FloatArray) -> float:
    """Return the largest difference of an angle, modulo whole turns."""
    return float(np.abs((q - other + np.pi) % (2.0 * np.pi) - np.pi).max())
