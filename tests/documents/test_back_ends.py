"""docs/back_ends.md equals the output of its script."""

from __future__ import annotations

import re

import pytest

from docs.tools.back_ends import document
from tests.locations import ROOT

PAGE = (ROOT / "docs/back_ends.md").read_text(encoding="utf-8")
NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?")
SOLVER = "min_effort"
"""Not compared: the result of a nonlinear solver differs between machines, and takes most of the time."""


def without_solver(text: str) -> list[str]:
    """Return the lines of results that involve no nonlinear solver."""
    best = ("- Cheapest", "- Smoothest")  # may be the solver's
    return [line for line in text.splitlines() if line and SOLVER not in line and not line.startswith(best)]


def test_the_page_is_what_the_script_makes() -> None:
    shown = without_solver(PAGE)
    made = without_solver(document(skipped=[SOLVER]))
    assert [NUMBER.sub("", line) for line in shown] == [NUMBER.sub("", line) for line in made]
    for line, again in zip(shown, made, strict=True):
        numbers, expected = ([float(text) for text in NUMBER.findall(row)] for row in (line, again))
        assert numbers == pytest.approx(expected, rel=0.011), line


def test_the_page_shows_the_published_durations_and_a_solver_that_saves_effort() -> None:
    starts = re.findall(r"^\| published: .*?\| (\d+(?:\.\d+)?) \|", PAGE, flags=re.MULTILINE)
    assert [float(duration) for duration in starts] == [37.6] * 4 + [30.0] * 2
    (saved,) = re.findall(r"^- Cheapest .*`min_effort`, effort [\d.]+ \(x ([\d.]+)\)", PAGE, flags=re.MULTILINE)
    assert float(saved) < 1.0
