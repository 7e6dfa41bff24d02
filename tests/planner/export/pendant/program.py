"""A pendant program of any language as its reader returns it, in SI units."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np


@dataclass
class Statement:
    """A motion of a program, with the settings in force and the waits, s, and outputs after it.

    Attributes:
        kind: `joint`, `line` or `circle`.
        waypoint: Index in the comment before it.
        values: Joint positions, rad, or transforms of the tool in the plan's base.
        blend: The radius of its blend, m; 0: none; None: the language does not state it in metres.
        is_passed: Whether the motion goes on without a stop.
        speeds: Speeds and accelerations, each with its resolution, by the names of `Speeds`.
        tool: The transform of the tool in the tip frame, if the program sets one.
    """

    kind: str
    waypoint: int
    values: list[np.ndarray]
    blend: float | None
    is_passed: bool
    speeds: dict[str, tuple[float, float]]
    tool: np.ndarray | None = None
    rest: list[object] = field(default_factory=list)


@dataclass
class Program:
    """A program: where it goes slowly at first, rad, the rest there, and its motions."""

    start: np.ndarray
    before: list[object]
    statements: list[Statement]


def transform(position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Return the 4x4 matrix of a position and a rotation."""
    found = np.eye(4)
    found[:3, 3], found[:3, :3] = position, rotation
    return found


def floats(texts: Iterable[str]) -> np.ndarray:
    """Return the numbers of the groups of a match."""
    return np.array([float(text) for text in texts])
