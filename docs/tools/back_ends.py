"""Two published motions through every back end, as the tables of docs/back_ends.md.

Run: python -m docs.tools.back_ends > docs/back_ends.md
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.work.local_plan import plan_request, read_request
from planner.backends import BACKENDS
from planner.comparison import Figures, figures
from planner.errors import PlanningError
from planner.trajectories.polynomials import differentiate, horner

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.trajectories.trajectory import Trajectory

EXAMPLES = Path(__file__).parents[2] / "examples"
VARIANTS: dict[str, tuple[dict[str, Any], ...]] = {
    "toppra": ({}, {"jerk_limited": True}),
    "min_effort": ({}, {"objective": "jerk"}),
}
"""Options of the back ends that have more than one row."""

ZERO = 1e-6
"""Below this a figure is rounding."""

HEADER = """\
# The published motions through every back end

Made by `python -m docs.tools.back_ends > docs/back_ends.md`; the tests make it again and compare.

Each back end plans the waypoints of two of the documents, first with the published durations, then as fast as it can
(durations left out). The first row of each table is the motion as published. In brackets: as a multiple of it.

- Step: the largest step of a joint's acceleration, rad/s^2 or m/s^2, rest before and after included.
- Peak jerk: the largest of any joint, rad/s^3 or m/s^3. RMS jerk: root of the mean over time of the sum over joints of
  jerk^2. Both are unbounded where the acceleration has a step.
- Effort: integral over time of the sum over joints of (torque / limit)^2, s. Energy: integral of the sum over joints of
  |torque x velocity|, J. A dash: masses or torque limits are not known.
- Off path: largest distance of the tool from the path of the straight joint motions, or from its straight line, mm.

## Two solvers of toppra

`toppra` computes its velocity profile with a compiled kernel, or with `"solver": "package"` by the package toppra;
the answer's `solver` says which. The kernel is the default because it was ahead in duration and in processor time, in
one run of 447 jobs of the tests' corpus. It gave shorter trajectories for 251 of them, and longer ones for 46. These
were longer by 3e-6 at most but for one job, whose intervals the package's solution split once more for 0.04 %. It
took 7.6 instead of 17.3 ms for 10 waypoints passed by a UR5 with torque limits. None was refused by one alone. The
tests compare both in every run.
"""
COLUMNS = ("back end", "duration s", "step", "peak jerk", "RMS jerk", "effort s", "energy J", "off path mm")


@dataclass(frozen=True)
class Case:
    """A published motion; `changes` are made to the file of its request."""

    title: str
    file: str
    note: str
    changes: dict[str, Any]

    def request(self, timed: bool) -> dict[str, Any]:
        """Return the request, with the published durations or without any."""
        request: dict[str, Any] = json.loads((EXAMPLES / self.file).read_bytes()) | self.changes
        if not timed:
            for waypoint in request["waypoints"]:
                waypoint.pop("duration", None)
        return request


CASES = (
    Case(
        "Refuelling, case 2",
        "refuelling_case_2.json",
        "Document 000: five joint positions, cubics from rest to rest. The arm has neither masses nor torque limits.",
        {},
    ),
    Case(
        "Refuelling, case 2, on a KUKA KR 16 L6-2",
        "refuelling_case_2.json",
        "The same joint positions on the robot that the thesis is about, whose masses and torque limits are estimates. "
        "Zeros of its axes differ, so the tool goes elsewhere. In 37.6 s most of the effort is holding the arm up. "
        "`min_effort` saves it by leaving the path for poses that need less holding torque, at a price in energy "
        "and jerk.",
        {"robot": "kuka_kr16_l6_2"},
    ),
    Case(
        "Date sorting, first transition",
        "date_sorting_transition_1.json",
        "Document 004: a straight line of the tool, a trapezoid with ramps of 10 s. The energy is that of the 1 kg for "
        "which the document gives torques; the arm has neither masses nor torque limits.",
        {"payload": {"mass": 1.0}},
    ),
)


def back_ends() -> Iterator[dict[str, Any]]:
    """Yield every back end as a request has it."""
    for kind in BACKENDS:
        for options in VARIANTS.get(kind, ({},)):
            yield {"kind": kind, **options}


def document(skipped: Sequence[str] = ()) -> str:
    """Return the whole document, without the rows of some kinds of back ends."""
    asked = [backend for backend in back_ends() if backend["kind"] not in skipped]
    parts = [HEADER]
    for case in CASES:
        published = measure(case.request(timed=True))
        same, best = (measure_all(case.request(timed), asked) for timed in (True, False))
        parts += [f"## {case.title}\n\n{case.note}\n", summary(published, same, best)]
        for title, rows in (("At the published durations", same), ("As fast as possible", best)):
            parts.append(f"### {title}\n\n{table(published, rows)}")
    return "\n".join(parts)


@dataclass(frozen=True)
class Measured:
    """A plan in figures.

    Attributes:
        label: Of the back end.
        figures: Its costs.
        step: Largest step of a joint's acceleration, rad/s^2 or m/s^2; below `ZERO`: none.
        keeps_jerk: Whether its jerk stays within the limits.
    """

    label: str
    figures: Figures
    step: float
    keeps_jerk: bool


@dataclass(frozen=True)
class Refused:
    """Why there is no plan."""

    label: str
    reason: str


def measure(request: dict[str, Any]) -> Measured:
    """Measure the costs of a plan."""
    plan = plan_request(read_request(json.dumps(request).encode()))
    jerk = next(check for check in plan.certificate.checks if check.quantity == "jerk")
    return Measured(label_of(request["backend"]), figures(plan), acceleration_step(plan.trajectory), jerk.satisfied)


def measure_all(request: dict[str, Any], asked: Sequence[dict[str, Any]]) -> list[Measured | Refused]:
    """Return the same waypoints through several back ends."""
    rows: list[Measured | Refused] = []
    for backend in asked:
        try:
            rows.append(measure(request | {"backend": backend}))
        except PlanningError as refusal:
            rows.append(Refused(label_of(backend), f"`{refusal.code}`: {refusal.message}"))
    return rows


def acceleration_step(trajectory: Trajectory) -> float:
    """Return largest step of a joint's acceleration between pieces, and to rest before and after."""
    second = differentiate(trajectory.coefficients, 2)
    rest = np.zeros((1, second.shape[1]))
    starts = np.concatenate([second[..., 0], rest])
    ends = np.concatenate([rest, horner(second, trajectory.lengths[:, None])])
    return float(np.abs(starts - ends).max())


def label_of(backend: dict[str, Any]) -> str:
    """Return kind and options."""
    options = [f"{name} = {json.dumps(value)}" for name, value in backend.items() if name != "kind"]
    return ", ".join([backend["kind"], *options])


def summary(published: Measured, same: Sequence[Measured | Refused], best: Sequence[Measured | Refused]) -> str:
    """Return the best of each column in words."""
    at_same, at_best = ([row for row in rows if isinstance(row, Measured)] for rows in (same, best))
    fast = min(at_best, key=by_duration)
    within_jerk = min((row for row in at_best if row.keeps_jerk), key=by_duration)
    smooth = min((row for row in at_same if row.step < ZERO), key=lambda row: row.figures.rms_jerk)
    duration, jerk = (getattr(published.figures, name) for name in ("duration", "rms_jerk"))
    lines = [
        f"- Fastest: {_times_as_fast(fast, duration)}; within the jerk limits {_times_as_fast(within_jerk, duration)}.",
        f"- Smoothest at the same duration: `{smooth.label}`, without steps of the acceleration (published: "
        f"{_rounded(published.step)}); RMS jerk {_compared(smooth.figures.rms_jerk, jerk)}.",
    ]
    efforts = [(row.figures.effort, row.label) for row in at_same if row.figures.effort is not None]
    if efforts:
        effort, label = min(efforts)
        change = _compared(effort, published.figures.effort)
        lines.append(f"- Cheapest at the same duration: `{label}`, effort {change}.")
    return "\n".join(lines) + "\n"


def _times_as_fast(row: Measured, duration: float) -> str:
    share = duration / row.figures.duration
    return f"{share:.1f} times as fast ({_rounded(row.figures.duration)} s, `{row.label}`)"


def by_duration(row: Measured) -> float:
    """Return the duration of a row for sorting, rounded so that the first of equal rows wins."""
    return round(row.figures.duration, 6)


def table(published: Measured, rows: Sequence[Measured | Refused]) -> str:
    """Return the figures of some plans, and below them why others were refused."""
    planned = [row for row in rows if isinstance(row, Measured)]
    first = _cells(replace(published, label=f"published: {published.label}"), published.figures)
    rules = [" --- "] + [" ---: "] * (len(COLUMNS) - 1)
    lines = [_line(COLUMNS), f"|{'|'.join(rules)}|", _line(first)]
    lines += [_line(_cells(row, published.figures)) for row in planned]
    lines += [f"\n`{row.label}` is refused, {row.reason}." for row in rows if isinstance(row, Refused)]
    return "\n".join(lines) + "\n"


def _cells(row: Measured, published: Figures) -> list[str]:
    names = ("duration", "peak_jerk", "rms_jerk", "effort", "mechanical_energy")
    duration, *others = (_compared(getattr(row.figures, name), getattr(published, name)) for name in names)
    return [row.label, duration, _rounded(row.step), *others, f"{1000.0 * row.figures.path_deviation:.1f}"]


def _compared(value: float | None, reference: float | None) -> str:
    """Return a value, and as a multiple of the published one unless they look the same."""
    if value is None or reference is None:
        return "-"
    text = _rounded(value)
    if not np.isfinite([value, reference]).all():
        return text
    return text if text in ("0", _rounded(reference)) else f"{text} (x {_rounded(value / reference)})"


def _rounded(value: float) -> str:
    """Round a number to three significant digits."""
    if abs(value) < ZERO:
        return "0"
    if np.isinf(value):
        return "unbounded"
    return np.format_float_positional(value, precision=3, unique=False, fractional=False, trim="k").rstrip(".")


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    print(document(), end="")
