"""Faults older than their rule: one line per file and rule with a count, which may only fall."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from tests.lint.sources import Fault

BASELINE = Path(__file__).parent / "baseline.txt"

Key = tuple[str, str]
"""A file and a rule."""


def read() -> dict[Key, int]:
    """Read the baseline; of two lines for one file, which a merge may leave, the smaller count holds."""
    counts: dict[Key, int] = {}
    for line in BASELINE.read_text(encoding="utf-8").splitlines():
        file, rule, number = line.split()
        counts[file, rule] = min(int(number), counts.get((file, rule), int(number)))
    return counts


def write(counts: Mapping[Key, int]) -> None:
    """Write the baseline, in alphabetical order."""
    lines = [f"{file} {rule} {number}\n" for (file, rule), number in sorted(counts.items())]
    BASELINE.write_text("".join(lines), encoding="utf-8")


def count(found: Mapping[str, Iterable[Fault]]) -> Counter[Key]:
    """Count faults by file and rule."""
    return Counter((fault.file, rule) for rule, faults in found.items() for fault in faults)


def compare(counts: Mapping[Key, int], allowed: Mapping[Key, int]) -> tuple[set[Key], int]:
    """Find the counts that rose, and the number of faults that fell.

    A file without a line may have as many faults of a rule as other files lost: it holds text that moved.
    """
    lost: Counter[str] = Counter()
    for (file, rule), number in allowed.items():
        lost[rule] += max(0, number - counts.get((file, rule), 0))
    new: Counter[str] = Counter()
    for (file, rule), number in counts.items():
        new[rule] += number if (file, rule) not in allowed else 0
    risen = {
        (file, rule)
        for (file, rule), number in counts.items()
        if (number > allowed[file, rule] if (file, rule) in allowed else new[rule] > lost[rule])
    }
    return risen, sum(lost.values())


def lowered(counts: Mapping[Key, int], allowed: Mapping[Key, int]) -> dict[Key, int]:
    """Return the baseline without mended faults; counts that rose stay at their old value."""
    risen, _ = compare(counts, allowed)
    kept = {key: min(number, allowed.get(key, number)) for key, number in counts.items()}
    return {key: number for key, number in kept.items() if key in allowed or key not in risen}
