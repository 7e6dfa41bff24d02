"""The heaviest payload with which torques keep their limits."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from planner.dynamics import heaviest_mass
from planner.errors import Remedy
from planner.fields import FieldPath
from planner.planning.proofs import Change
from planner.problems.problem import PlanningProblem
from planner.robots import Robot
from planner.robots.payload import Payload
from planner.spatial import FloatArray


def lighter_payload(
    problem: PlanningProblem,
    torques: Callable[[Robot, np.ndarray], FloatArray],
    segments: np.ndarray,
    limit: FloatArray,
    shares: Sequence[float],
    explanation: str,
) -> Iterator[Change]:
    """Yield payloads as heavy as the limits allow, for each fraction; nothing if no lighter payload suffices.

    Args:
        problem: A problem, with its detours, with or without payloads.
        torques: (M, joints), of a robot with its payload in M states of some motion or at rest, by their mask (N,).
            They are affine in the mass of the payload: two masses tell all.
        segments: (N,), the segment of each state.
        limit: (N, joints).
        shares: Shares of the limit that the torques may take.
        explanation: The explanation of the remedy.
    """
    measured = []
    for field, payload, first, last in _carried(problem):
        rows = (segments >= first) & (segments < last)
        half, whole = (
            torques(problem.robot.with_payload(replace(payload, mass=mass)), rows)
            for mass in (0.5 * payload.mass, payload.mass)
        )
        per_mass = (whole - half) / (0.5 * payload.mass)
        measured.append((field, payload.mass, per_mass, whole - payload.mass * per_mass, limit[rows]))
    for share in shares:
        lighter = []
        for field, mass, per_mass, without, own_limit in measured:
            most = heaviest_mass(without, per_mass, -share * own_limit, share * own_limit)
            if most <= 0.0:
                return
            if most < mass:
                lighter.append(Remedy((*field, "mass"), most, explanation))
        if lighter:
            yield lighter


def _carried(problem: PlanningProblem) -> Iterator[tuple[FieldPath, Payload, int, int]]:
    """Yield the payloads: field, payload, and the segments from the first to before the last."""
    requested: list[tuple[FieldPath, Payload | None, int]] = [(("payload",), problem.payload, 0)]
    for i, waypoint in enumerate(problem.waypoints):
        if waypoint.payload is not None or waypoint.put_down:
            requested.append((("waypoints", problem.numbers[i], "payload"), waypoint.payload, i))
    ends = [first for _, _, first in requested[1:]]
    for (field, payload, first), last in zip(requested, [*ends, len(problem.waypoints)], strict=True):
        if payload is not None and first < last:
            yield field, payload, first, last
