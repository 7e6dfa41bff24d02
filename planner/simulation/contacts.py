"""Contacts of a simulated arm: overlaps of its shapes with each other and with its surroundings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from planner.scene.checker import CollisionChecker
from planner.spatial import FloatArray


@dataclass(frozen=True)
class Contact:
    """An overlap of two links or objects in a simulated run.

    Attributes:
        pair: The names of the links or objects.
        time: The first time, s.
        depth: The largest depth, m.
        depth_time: The time of that depth, s.

    Examples:
        >>> import planner
        >>> planner.Contact(("ball", "table"), 0.1, 0.004, 0.5).depth
        0.004
    """

    pair: tuple[str, str]
    time: float
    depth: float
    depth_time: float


def find_contacts(checkers: Sequence[CollisionChecker], time: FloatArray, positions: FloatArray) -> tuple[Contact, ...]:
    """Find the contacts at some times, in the order in which they begin.

    Allowed pairs are left out, and so are the contacts of objects that the robot takes or puts down.

    Args:
        checkers: The robot and its surroundings at each time: N, the same object where nothing changes.
        time: (N,), increasing, s.
        positions: (N, joints), rad or m.
    """
    from planner.simulation.geometry import Geometry

    geometry, found = None, dict[tuple[str, str], Contact]()
    for moment, checker, position in zip(time.tolist(), checkers, positions, strict=True):
        if geometry is None or geometry.checker is not checker:
            geometry = Geometry(checker)
        for pair, depth in geometry.overlaps(moment, position):
            known = found.get(pair)
            if known is None:
                found[pair] = Contact(pair, moment, depth, moment)
            elif depth > known.depth:
                found[pair] = Contact(pair, known.time, depth, moment)
    return tuple(found.values())
