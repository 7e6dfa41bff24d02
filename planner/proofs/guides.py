"""Guides: lines and circles as mechanisms that carry the tool along the path, and the shares of the path by time."""

from __future__ import annotations

from typing import Any

import numpy as np

from planner.certificate.lines_and_circles import Circle, Line
from planner.spatial import FloatArray

SHORTEST = 1e-9
"""Length of a path, m, and angle of its turn, rad, below which it is none."""

NODES = np.cos(np.pi * (np.arange(6) + 0.5) / 6.0)
"""Chebyshev nodes on [-1, 1] of the polynomials of shares."""

TO_COEFFICIENTS = np.linalg.inv(np.vander(NODES, increasing=True))
"""Matrix from values at the nodes to coefficients."""

DIGITS_OF_SHARES = 13
"""Decimal places of the shares of a path."""


def guide_of(path: Line | Circle) -> dict[str, Any] | None:
    """Return a path as a mechanism whose joint positions are polynomials of the share of the path.

    Returns:
        Plain values, with the coefficients of each joint under `rates`; None: the tool turns about more than one axis.
    """
    turn, bend = path.turns
    if np.linalg.norm(np.cross(turn, bend)) > SHORTEST**2 or np.linalg.norm(bend) > SHORTEST:
        return None
    links, rates, axes, shift = _rail(path) if isinstance(path, Line) else _wheel(path)
    rotation = np.eye(3)
    if path.start is not None:
        about = _frame_along(turn)
        links.append(link_of(axes.T @ path.start @ about, shift, "revolute"))
        rates.append(float(np.linalg.norm(turn)))
        rotation, shift = about.T, np.zeros(3)
    tool = {"joint": len(links), "rotation": rotation.tolist(), "translation": shift.tolist()}
    return {"links": links, "rates": [[rate] for rate in rates], "tool": tool}


def shares_of(path: Line | Circle, positions: FloatArray, rotations: FloatArray) -> list[float]:
    """Return the coefficients of the share of a path that the tool has reached, by x on [-1, 1].

    Args:
        path: The path.
        positions: (6, 3), m, of the tool at the nodes.
        rotations: (6, 3, 3), of the tool there.
    """
    if isinstance(path, Circle):
        spokes, middle = positions - path.center, path.end_angle / 2.0
        angles = np.arctan2(spokes @ path.y, spokes @ path.x) - middle
        shares = ((angles + np.pi) % (2.0 * np.pi) - np.pi + middle) / path.end_angle
    elif np.linalg.norm(path.way) > SHORTEST:
        shares = (positions - path.origin) @ path.way / (path.way @ path.way)
    else:
        shares = _turned_shares(path, rotations)
    return share_coefficients(shares.clip(0.0, 1.0))


def share_coefficients(shares: FloatArray) -> list[float]:
    """Return the coefficients by x on [-1, 1] of shares (6,) at the nodes."""
    found: list[float] = (TO_COEFFICIENTS @ shares).round(DIGITS_OF_SHARES).tolist()
    return found


def _turned_shares(path: Line, rotations: FloatArray) -> FloatArray:
    angle = float(np.linalg.norm(path.turns[0]))
    if path.start is None or angle < SHORTEST:
        return np.zeros(len(rotations))
    about = _frame_along(path.turns[0])
    turned = about.T @ path.start.T @ rotations @ about
    angles = np.arctan2(turned[:, 1, 0] - turned[:, 0, 1], turned[:, 0, 0] + turned[:, 1, 1])
    shares: FloatArray = angles / angle
    return shares


def _rail(line: Line) -> tuple[list[dict[str, Any]], list[float], FloatArray, FloatArray]:
    """Return the links of a line, their rates, the axes at the end and the point in them."""
    axes = _frame_along(line.way)
    return [link_of(axes, line.origin, "prismatic")], [float(np.linalg.norm(line.way))], axes, np.zeros(3)


def _wheel(circle: Circle) -> tuple[list[dict[str, Any]], list[float], FloatArray, FloatArray]:
    """Return the links of a circle, their rates, the axes at the end and the point in them.

    The second link turns back, so that the orientation does not depend on the place.
    """
    radius = float(np.linalg.norm(circle.x))
    x, y = circle.x / radius, circle.y / float(np.linalg.norm(circle.y))
    axes, spoke = np.column_stack([x, y, np.cross(x, y)]), np.array([radius, 0.0, 0.0])
    links = [link_of(axes, circle.center, "revolute"), link_of(np.eye(3), spoke, "revolute")]
    return links, [circle.end_angle, -circle.end_angle], axes, np.zeros(3)


def link_of(rotation: FloatArray, origin: FloatArray, motion: str) -> dict[str, Any]:
    """Return a joint whose frame has a rotation (3, 3) and an origin (3,), m, in the frame before."""
    return {"rotation": rotation.tolist(), "origin": origin.tolist(), "motion": motion}


def _frame_along(direction: FloatArray) -> FloatArray:
    """Return a rotation (3, 3) whose z axis has a direction (3,); of none: the base frame."""
    length = float(np.linalg.norm(direction))
    if length < SHORTEST:
        return np.eye(3)
    z = direction / length
    x = np.cross(np.eye(3)[int(np.abs(z).argmin())], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
