"""The back end that suits the request, and why."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from planner.backends.ruckig.ruckig import Ruckig
from planner.backends.splines.quintic import Quintic
from planner.backends.toppra.toppra import Toppra
from planner.errors import InfeasibleDuration, PlanningError
from planner.guarantees import ALL_HARD, Guarantee
from planner.trajectory import Remark

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.backends.base import BackEnd
    from planner.paths import JointPath
    from planner.trajectory import Trajectory


@dataclass(frozen=True)
class Auto:
    """A back end that keeps every limit, jerk included: the fastest, unless the durations asked call for another.

    Where the first choice refuses, the next one is tried; where all do, the refusal stands that is nearest to a plan.
    """

    kind: ClassVar[str] = "auto"
    summary: ClassVar[str] = "The back end that suits the request, with the reason in a warning; keeps every limit, C2."
    guarantees: ClassVar[Mapping[str, Guarantee]] = ALL_HARD

    def parametrize(self, path: JointPath) -> Trajectory:
        """The trajectory of the back end chosen, with a remark that says which and why."""
        refusals: list[PlanningError] = []
        for backend, name, reason in _choices(path):
            try:
                trajectory = backend.parametrize(path)
            except PlanningError as refusal:
                refusals.append(refusal)
                continue
            spared = f"; before it {len(refusals)} refused: {refusals[0].message}" if refusals else ""
            remark = Remark("auto_choice", f"{name}: {reason}{spared}")
            return replace(trajectory, remarks=(*trajectory.remarks, remark))
        raise min(refusals, key=_shortfall)


def _shortfall(refusal: PlanningError) -> float:
    """The factor by which a duration is too short; infinite where that is not what is wrong."""
    if isinstance(refusal, InfeasibleDuration) and refusal.value and refusal.limit:
        return refusal.limit / refusal.value
    return float("inf")


def _choices(path: JointPath) -> Iterator[tuple[BackEnd, str, str]]:
    """Back ends, their names and the reasons for them, the best first."""
    asked = ~np.isnan(path.durations)
    inside = any(len(run.segments) > 1 and asked[run.segments].any() for run in path.runs)
    if inside:
        yield Quintic(), "quintic", "it keeps the durations asked of segments that are passed without stopping"
    elif asked[path.moving].all():
        yield Quintic(), "quintic", "every duration is asked, so there is no time to gain, and its jerk is low"
    yield Ruckig(), "ruckig", "the fastest that keeps the jerk limits, too"
    yield Toppra(jerk_limited=True), "toppra, jerk_limited", "the fastest on the given path within the jerk limits"
    if not inside and not asked[path.moving].all():
        yield Quintic(), "quintic", "within all limits"
