"""All jobs by name: `FAMILY-NUMBER-ARM`, each made at its first use."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.corpus import contours, degenerate, features, handling, seams
from benchmarks.corpus.arms import ARMS, INSTALLED, places
from benchmarks.corpus.checks import SLOW
from benchmarks.corpus.infeasible import infeasible
from benchmarks.corpus.job import Draft, Job
from benchmarks.corpus.programme import Untraceable
from planner.backends import Auto, BackEnd, Cubic, MinEffort, Quintic, Ruckig, Toppra, Trapezoidal
from planner.planning import plan

if TYPE_CHECKING:
    from planner.plans.result import Plan

DRAFTS = {**handling.FAMILIES, **seams.FAMILIES, **contours.FAMILIES, **degenerate.FAMILIES, **features.FAMILIES}

VARIANTS = {
    **dict.fromkeys(DRAFTS, 18),
    **dict.fromkeys(features.FAMILIES, 6),
    "near_equal": 36,
    "still_joints": 20,
    "infeasible": 12,
}
"""How many of each family there are for each arm."""

BACK_ENDS = ("cubic", "quintic", "trapezoidal", "ruckig", "toppra", "toppra_jerk_limited", "min_effort", "auto")

FROM_PACKAGE = ("ur5", "panda")
"""Arms that are there only where the package of robots is installed."""

SUITE_SHIPPED, SUITE_FROM_PACKAGE = 14, 3
"""Jobs of every family in the tests."""

FEATURES_SHIPPED, FEATURES_FROM_PACKAGE = 5, 2
"""Jobs of those families in the tests that need what robot programmers ask for besides."""

ONLY_BY = {
    "past_a_switch": ("cubic", "quintic", "ruckig", "auto"),
    "full_cups": ("quintic", "ruckig", "toppra_jerk_limited", "min_effort", "auto"),
}
"""Back ends of families that the others refuse: they keep no such limit."""

SHORT_ONES = {"deburring": (0, 1, 3, 5, 8, 10, 12, 13, 15, 17)}
"""Variants of a family whose others take long."""

SHRUNK = (1.0, 0.5, 0.25)
"""A job that an arm can do nowhere is tried at half its size, then at a quarter."""

SETTLING = 0.5
"""s that a seam may take beyond length over speed at each waypoint: to get up to speed and to brake."""


def names(family: str | None = None) -> list[str]:
    """Return names of all jobs of the installed arms, or of a family's."""
    families = VARIANTS if family is None else [family]
    return [
        f"{name}-{variant:02d}-{arm}" for name in families for variant in range(VARIANTS[name]) for arm in INSTALLED
    ]


def back_ends_of(name: str) -> tuple[str, ...]:
    """Return names of the back ends that can do a job: they keep all its requirements."""
    return ONLY_BY.get(name.split("-")[0], BACK_ENDS)


def backend_of(kind: str, job: Job) -> BackEnd:
    """Return a back end as requested by a job."""
    knows_torques = job.problem.robot.has_dynamics or all(job.problem.payloads)
    made: dict[str, BackEnd] = {
        "cubic": Cubic(),
        "quintic": Quintic(),
        "trapezoidal": Trapezoidal(),
        "ruckig": Ruckig(),
        "toppra": Toppra(),
        "toppra_jerk_limited": Toppra(jerk_limited=True),
        "min_effort": MinEffort(knots=16, objective="effort" if knows_torques else "jerk"),
        "auto": Auto(),
    }
    return made[kind]


@cache
def job(name: str) -> Job:
    """Make a job.

    Raises:
        KeyError: There is no such family.
        ValueError: The arm can do this nowhere.
    """
    family, number, arm = name.split("-")
    variant, there = int(number), places(arm)
    for k in range(len(SHRUNK) * len(there)):
        place = there[(variant + k) % len(there)]
        place = replace(place, size=place.size * SHRUNK[k // len(there)])
        try:
            if family == "infeasible":
                problem, why, codes = infeasible(place, variant)
                return Job(name, family, {"place": k}, problem, infeasible=why, codes=codes)
            return _job(name, DRAFTS[family](place, variant), arm)
        except Untraceable:
            continue
    raise ValueError(f"{name}: {arm} can do this nowhere")


def _job(name: str, draft: Draft, arm: str) -> Job:
    programme, family = draft.programme, name.split("-")[0]
    problem = replace(programme.problem(draft.limits, draft.carries), actions=draft.actions)
    least = programme.seconds - programme.seconds_cut
    settling = SETTLING * len(problem.waypoints)
    twin = None if draft.twin is None else f"{family}-{draft.twin:02d}-{arm}"
    return Job(
        name,
        family,
        draft.parameters,
        problem,
        positions=np.array(programme.positions),
        durations=None if problem.robot.has_dynamics else draft.durations,
        least_duration=least if least > 0.0 else None,
        most_duration=SLOW * programme.seconds + settling if draft.only_seams else None,
        twin=twin if twin != name else None,
    )


def plan_job(asked: Job, kind: str) -> Plan:
    """Plan a job by a back end."""
    return plan(asked.problem, backend_of(kind, asked))


def suite() -> list[str]:
    """Return names of the jobs that the tests plan: some of every family, more for arms that ship."""
    shipped = [arm for arm in ARMS if arm not in FROM_PACKAGE]
    chosen = []
    for family, count in VARIANTS.items():
        variants = SHORT_ONES.get(family, tuple(range(count)))
        counts = (SUITE_SHIPPED, SUITE_FROM_PACKAGE)
        if family in features.FAMILIES:
            counts = (FEATURES_SHIPPED, FEATURES_FROM_PACKAGE)
        for arms, number in zip((shipped, FROM_PACKAGE), counts, strict=True):
            picks = [
                (variants[(5 * i + i // len(variants)) % len(variants)], arms[i % len(arms)]) for i in range(number)
            ]
            chosen += [f"{family}-{variant:02d}-{arm}" for variant, arm in picks if arm in INSTALLED]
    return chosen
