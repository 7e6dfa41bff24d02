"""Results of the corpus of jobs in files."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from typing_extensions import override

from benchmarks.corpus.corpus import BACK_ENDS

if TYPE_CHECKING:
    from collections.abc import Iterable

BEFORE, AFTER = (Path(__file__).parents[1] / f"results/jobs_{name}.csv" for name in ("before", "after"))

NO_FAULT = frozenset({"slow by its law"})
"""Remarks about plans that are not faults."""


@dataclass(frozen=True)
class Result:
    """The result of one job by one back end.

    Attributes:
        outcome: `planned`, `refused`, or how it was given up.
        faults: Kinds of its faults.
        milliseconds: Processor time; None where it was given up.
    """

    outcome: str
    faults: frozenset[str]
    milliseconds: int | None

    @classmethod
    def parse(cls, text: str) -> Result:
        """Read it as `str` writes it."""
        words, _, milliseconds = text.partition(" ")
        outcome, *faults = (word.replace("_", " ") for word in words.split("+"))
        return cls(outcome, frozenset(faults), int(milliseconds) if milliseconds else None)

    @override
    def __str__(self) -> str:
        words = "+".join(word.replace(" ", "_") for word in (self.outcome, *sorted(self.faults)))
        return words if self.milliseconds is None else f"{words} {self.milliseconds}"

    @property
    def is_good(self) -> bool:
        """Whether nothing is wrong with it."""
        return not self.faults - NO_FAULT


Results = dict[str, dict[str, Result]]
"""By the name of the job, and the back end."""


def save(records: Iterable[dict[str, Any]], file: Path) -> None:
    """Write judged records, one line for each job, one column for each back end."""
    rows: dict[str, dict[str, str]] = {}
    for it in records:
        milliseconds = round(1e3 * it["seconds"]) if "seconds" in it else None
        faults = frozenset(kind.replace("_", " ") for kind, _ in it["faults"])
        result = Result(it["outcome"].replace("_", " "), faults, milliseconds)
        rows.setdefault(it["job"], {"job": it["job"]})[it["backend"]] = str(result)
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, ["job", *BACK_ENDS], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows.values())


def load(file: Path) -> Results:
    """Read what `save` has written."""
    with file.open(encoding="utf-8", newline="") as stream:
        return {
            row["job"]: {kind: Result.parse(row[kind]) for kind in BACK_ENDS if row[kind]}
            for row in csv.DictReader(stream)
        }
