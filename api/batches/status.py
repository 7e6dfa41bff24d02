"""The description of a batch: its progress, rate and outcomes."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from api.store.items import PLANNED

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from api.store.batch_reports import ReportFigures
    from api.store.batches import BatchRecord, Outcomes


def described(
    batch: BatchRecord, outcomes: Sequence[Outcomes], histogram: list[int], examples: Mapping[str, int]
) -> dict[str, Any]:
    """Write a batch as the schema `Batch` says.

    Args:
        batch: The batch.
        outcomes: Its items by their outcome.
        histogram: How its durations are spread.
        examples: The position of one item with each code of a problem.
    """
    counts = {found.outcome: found.items for found in outcomes if found.outcome is not None}
    waiting, planned = batch.total - sum(counts.values()), counts.pop(PLANNED, 0)
    rate = batch.rate if batch.status == "running" else None
    return {
        **_dated(batch),
        "counts": {"total": batch.total, "waiting": waiting, "planned": planned, "refused": sum(counts.values())},
        "rate": rate,
        "remaining_time": waiting / rate if rate else None,
        "summary": {
            "duration": _durations(outcomes, histogram),
            "refusals": [{"code": code, "count": count, "example": examples[code]} for code, count in counts.items()],
            "worst_ratio": max((found.ratio for found in outcomes if found.ratio is not None), default=None),
        },
    }


def tabulated(figures: ReportFigures) -> dict[str, Any]:
    """Write the items of a report as plain values."""
    spreads = {name: getattr(figures, name) for name in ("duration", "ratio", "seconds")}
    kinds = {name: getattr(figures, name) for name in ("worst", "examples")}
    return {
        **{name: None if spread is None else spread._asdict() for name, spread in spreads.items()},
        **{
            name: {kind: [item._asdict() for item in found] for kind, found in of_kind.items()}
            for name, of_kind in kinds.items()
        },
    }


def listed(batch: BatchRecord) -> dict[str, Any]:
    """Write a batch as the schema `BatchEntry` says."""
    return {**_dated(batch), "total": batch.total}


def finished(description: dict[str, Any]) -> int:
    """Count the requests of a described batch that have been answered."""
    counts: dict[str, int] = description["counts"]
    return counts["total"] - counts["waiting"]


def _dated(batch: BatchRecord) -> dict[str, Any]:
    ended = None if batch.ended is None else _date(batch.ended)
    return {"id": batch.id, "status": batch.status, "created": _date(batch.created), "ended": ended}


def _date(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="milliseconds")


def range_of_durations(outcomes: Sequence[Outcomes]) -> tuple[float, float] | None:
    """Return the shortest and the longest duration of a trajectory, s; None: there is none."""
    for found in outcomes:
        if found.outcome == PLANNED and found.shortest is not None and found.longest is not None:
            return found.shortest, found.longest
    return None


def _durations(outcomes: Sequence[Outcomes], histogram: list[int]) -> dict[str, Any] | None:
    ends = range_of_durations(outcomes)
    if ends is None:
        return None
    mean = next(found.sum / found.items for found in outcomes if found.outcome == PLANNED and found.sum is not None)
    return {"shortest": ends[0], "mean": mean, "longest": ends[1], "histogram": histogram}
