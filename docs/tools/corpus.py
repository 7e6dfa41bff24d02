"""Write docs/corpus.md: results of the corpus by kind of job and back end, before and after.

Run: python -m docs.tools.corpus
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

from benchmarks.corpus.corpus import BACK_ENDS, VARIANTS
from benchmarks.jobs.jobs import MOST_SECONDS
from benchmarks.jobs.results import AFTER, BEFORE, NO_FAULT, load

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from benchmarks.jobs.results import Result, Results

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/corpus.md"

GIVEN_UP = frozenset({"crashed", "died", "hung", "out of time"})
"""What becomes of a plan that is neither made nor refused."""

COUNTED = ("refused", "broken", "slow", "slow on its path", "over budget")
"""The faults that have a column of their own."""

HEADER = """\
# The corpus of real jobs

`benchmarks/corpus/` makes some 3,000 jobs as robot programmers send them. They are structured lists of waypoints,
seeded, with the reference joint path or the reference time where one is known. Here are {jobs} of them, of every kind
at the time and for six arms. They went through all back ends (2,271 plans), before the work on them began and now.
Jobs with splines, goal regions, tools by waypoint, rails and velocities at waypoints came later. So did jobs with
tolerance regions on the path, jerk limits of the tool, teach speeds, locked joints, actions and limits by direction
(`benchmarks/corpus/features.py`).
`python -m benchmarks jobs --like benchmarks/results/jobs_before.csv --save benchmarks/results/jobs_after.csv` plans
them again (in about ten minutes), `python -m docs.tools.corpus` writes this page.

Every plan is checked without the certificate: limits, continuity, waypoints met, the tool on its lines and circles.
These faults are counted:

- Refused: there is no plan, though a joint path within the limits is known. Refusals of the jobs of the kind
  `infeasible` are none of these: that they are right, with the right reason, an independent check confirms.
- Given up: an error, no answer within {patience:.0f} s of computing, or a lack of memory.
- Broken: a limit, the continuity, a waypoint or a line was not kept.
- Slow: more than 2 % slower than the closed form or than length over speed. Also: than another back end along the same
  path that keeps no less.
- Own curve: more than 2 % slower than another back end that keeps no less, where each draws its own curve through
  passed waypoints.
- Late: over its budget of computing time, of one second for up to 200 waypoints. The time itself is processor time,
  in the median, on a machine that had other work to do.

"""

LINES = """\
## Lines that exist

Random lists of two to four straight lines of up to half a metre, at random places, that an arm can drive. A chain of
joint positions was followed along each by Newton steps before (as in
`tests/planner/tool_motions/test_random_lines.py`). They were planned twice: with the first waypoint as a pose, the arm
in any configuration, and with the joint position where the chain starts.

| | lists | refused, from the pose | refused, from the joint position |
| --- | ---: | ---: | ---: |
| kuka_kr16_l6_2 | 229 | 0 | 0 |
| ngv_refuelling_arm | 229 | 0 | 0 |
| date_sorting_arm | 228 | 0 | 0 |
| three_dof_arm | 192 | 0 | 0 |
| ur5 | 222 | 0 | 0 |
| panda | 978 | 0 | 3 |

Before the planner used self-motions on lines, it refused 9 of 300 such lists of the Panda from the pose. From the
joint position it refused 14 of 93. Three are left. With joints to spare, the end of a line is decided before the next
one is considered. Joint 1 then reaches its limit on the fourth line, joint 4 on the third. A self-motion away from all
limits at once may come too late for one line (joint 5, after 95 % of the first line).
"""
"""What became of random lists of lines, by a run of its own."""

EXPLANATIONS = {
    "slow on its path": """\
Own curve: between waypoints that are passed, `toppra` keeps to one curve, the C2 spline through them. `ruckig` draws
another, on which it is 2 to 9 % faster here; `auto` takes the faster of all.""",
    "over budget": """\
Late: lists of 20 to 80 waypoints whose time scalings are searched for, most of all by `min_effort`. `auto` plans by
more than one back end to take the best.""",
}
"""Remarks about the plans with a fault."""


def document(before: Results, after: Results) -> str:
    """Return the page."""
    plans = sum(map(len, before.values()))
    parts = [
        HEADER.format(jobs=len(before), plans=plans, patience=MOST_SECONDS),
        "## By back end\n\n",
        *_by(BACK_ENDS, before, after, lambda job, kind: kind),
        "\n## By kind of job\n\n",
        *_by(VARIANTS, before, after, lambda job, kind: _family(job)),
        "\n## By kind of job and back end\n\nPlans with which nothing is wrong, before, now, and of how many.\n\n",
        *_by_both(before, after),
        "\n## What is left\n\n",
        *_rest(after),
        LINES,
    ]
    return "".join(parts)


def _family(job: str) -> str:
    return job.split("-")[0]


def _row(*cells: object) -> str:
    return f"| {' | '.join(map(str, cells))} |\n"


def _by(rows: Iterable[str], before: Results, after: Results, key: Any) -> Iterator[str]:
    yield _row("", "plans", "planned", "refused", "given up", "broken", "slow", "own curve", "late", "ms")
    yield _row("---", *["---:"] * 9)
    for row in (*rows, "all"):
        sides = [
            [result for job, own in side.items() for kind, result in own.items() if row in ("all", key(job, kind))]
            for side in (before, after)
        ]
        if sides[0]:
            counts = zip(*map(_counts, sides), strict=True)
            yield _row(row, len(sides[0]), *(f"{was:,} → {now:,}" if was != now else f"{now:,}" for was, now in counts))


def _counts(results: list[Result]) -> list[int]:
    faults = Counter(fault for result in results for fault in result.faults)
    outcomes = Counter(result.outcome for result in results)
    given_up = sum(outcomes[outcome] for outcome in GIVEN_UP)
    times = [result.milliseconds for result in results if result.milliseconds is not None]
    refused, *others = (faults[fault] for fault in COUNTED)
    return [outcomes["planned"], refused, given_up, *others, round(median(times))]


def _by_both(before: Results, after: Results) -> Iterator[str]:
    yield _row("", *BACK_ENDS)
    yield _row("---", *["---:"] * len(BACK_ENDS))
    for family in VARIANTS:
        cells = []
        for kind in BACK_ENDS:
            was, now = (
                [own[kind].is_good for job, own in side.items() if _family(job) == family and kind in own]
                for side in (before, after)
            )
            count = f"{sum(was)} → {sum(now)}" if sum(was) != sum(now) else f"{sum(now)}"
            cells.append(f"{count} / {len(now)}" if now else "")
        if any(cells):
            yield _row(family, *cells)


def _rest(after: Results) -> Iterator[str]:
    """Yield all plans with faults, by kind of fault."""
    found: dict[str, list[str]] = {}
    for job, own in after.items():
        for kind, result in own.items():
            for fault in result.faults - NO_FAULT:
                late = f" ({result.milliseconds} ms)" if fault == "over budget" else ""
                found.setdefault(fault, []).append(f"{job} {kind}{late}")
    for fault, plans in sorted(found.items(), key=lambda item: len(item[1])):
        yield f"{EXPLANATIONS.get(fault, fault.capitalize())}\n\n"
        yield from (f"- {plan}\n" for plan in plans)
        yield "\n"


if __name__ == "__main__":
    PAGE.write_text(document(load(BEFORE), load(AFTER)), encoding="utf-8")
