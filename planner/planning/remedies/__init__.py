"""What would make a refused problem feasible, found by calculation and proved by a plan before it is offered."""

from __future__ import annotations

from planner.errors import (
    ClearanceUnproved,
    Collision,
    InfeasibleDuration,
    JointPositionLimit,
    LimitsUnsatisfiable,
    NoPathFound,
    PayloadExceeded,
    Remedy,
    UnreachableWaypoint,
)
from planner.planning.attempts import Proposals, Refused
from planner.planning.proofs import proved
from planner.planning.remedies.collisions import collision_remedies
from planner.planning.remedies.durations import duration_remedies
from planner.planning.remedies.holding import holding_remedies
from planner.planning.remedies.shaping import shaping_remedies
from planner.planning.remedies.shorter_lines import detour_remedies, shorter_line_remedies


def remedies_for(refused: Refused) -> Proposals[tuple[list[Remedy], list[Remedy]]]:
    """Find remedies for a refused attempt, each proved by a plan.

    Remedies that change durations belong together, as do remedies that change limits, and the payload. Each such group
    works by itself.

    Returns:
        The remedies, and hints: changes that the refusal names and that do not lead to a plan by themselves.
    """
    remedies, hints = yield from _remedies_of_kind(refused)
    if not remedies:
        remedies = yield from shaping_remedies(refused)
    return remedies, hints


def _remedies_of_kind(refused: Refused) -> Proposals[tuple[list[Remedy], list[Remedy]]]:
    """Find remedies by the kind of a refusal; see `remedies_for`."""
    refusal = refused.refusal
    if isinstance(refusal, InfeasibleDuration):
        return (yield from duration_remedies(refused, refusal)), []
    if isinstance(refusal, Collision | ClearanceUnproved):
        return (yield from collision_remedies(refused, refusal)), []
    if isinstance(refusal, NoPathFound):
        return (yield from detour_remedies(refused, refusal)), []
    if isinstance(refusal, PayloadExceeded):
        return (yield from proved(list(refusal.remedies), refused.attempt)), []
    remedies: list[Remedy] = []
    hints: list[Remedy] = []
    for remedy in refusal.remedies:
        helping = yield from proved([remedy], refused.attempt)
        remedies += helping
        hints += [] if helping else [remedy]
    if isinstance(refusal, LimitsUnsatisfiable) and not remedies:
        remedies = yield from holding_remedies(refused.attempt)
    if isinstance(refusal, UnreachableWaypoint | JointPositionLimit) and not remedies:
        remedies = yield from shorter_line_remedies(refused.attempt, refusal)
    return remedies, hints


__all__ = ["remedies_for"]
