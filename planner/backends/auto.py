"""The back end that suits the request, and why."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from planner.backends.base import BackEnd
from planner.backends.ruckig.ruckig import Ruckig
from planner.backends.splines.quintic import Quintic
from planner.backends.toppra.toppra import Toppra
from planner.errors import InfeasibleDuration, PlanningError
from planner.guarantees import ALL_HARD, Capabilities, Guarantee
from planner.paths import JointPath
from planner.trajectories.trajectory import PlanWarning, Trajectory


@dataclass(frozen=True)
class Auto:
    """A back end that keeps every limit, jerk included: the fastest by comparison, unless durations call for another.

    It compares `Ruckig` and `Quintic`. `Ruckig` moves each joint by its own time scaling, or all along one curve like
    `Toppra` with `jerk_limited`. If both refuse, it tries `Toppra`. If all refuse, it reports the refusal that is
    nearest to a plan.
    """

    kind: ClassVar[str] = "auto"
    summary: ClassVar[str] = "The back end that suits the request, with the reason in a warning; keeps every limit, C2."
    guarantees: ClassVar[Mapping[str, Guarantee]] = ALL_HARD
    capabilities: ClassVar[Capabilities] = Capabilities(passes_with_velocities=True, is_shaped_by_duration=True)

    def parametrize(self, path: JointPath) -> Trajectory:
        """Return the trajectory of the back end chosen, with a warning that says which and why."""
        refusals: list[PlanningError] = []
        for backends, reason in _choices(path):
            plans: dict[str, Trajectory] = {}
            for name, backend in backends.items():
                try:
                    plans[name] = backend.parametrize(path)
                except PlanningError as refusal:
                    refusals.append(refusal)
            if not plans:
                continue
            best = min(plans, key=lambda name: plans[name].duration)
            message = f"{best}: {reason}"
            if len(plans) > 1:
                message += ": " + ", ".join(f"{name} {plan.duration:.4g} s" for name, plan in plans.items())
            if refusals:
                message += f"; {len(refusals)} refused: {refusals[0].message}"
            return replace(plans[best], warnings=(*plans[best].warnings, PlanWarning("auto_choice", message)))
        raise min(refusals, key=_shortfall)


def _shortfall(refusal: PlanningError) -> float:
    """Return the factor by which a duration is too short; infinite if the refusal has another reason."""
    if isinstance(refusal, InfeasibleDuration) and refusal.value and refusal.limit:
        return refusal.limit / refusal.value
    return float("inf")


def _choices(path: JointPath) -> Iterator[tuple[dict[str, BackEnd], str]]:
    """Yield back ends by name, of which the fastest is taken, and the reason for it; the best choice first."""
    if path.passed_at:
        yield {"ruckig": Ruckig()}, "it passes waypoints with the requested velocities"
        yield {"quintic": Quintic()}, "it passes waypoints with the requested velocities"
        return
    requested = ~np.isnan(path.durations)
    inside = any(len(group.segments) > 1 and requested[group.segments].any() for group in path.groups)
    if inside:
        yield {"quintic": Quintic()}, "it keeps the requested durations within segment groups"
        yield {"ruckig": Ruckig()}, "it keeps all limits, jerk included"
    elif requested[path.moving].all():
        yield {"quintic": Quintic()}, "every duration is requested, so no time can be gained, and its jerk is low"
        yield {"ruckig": Ruckig()}, "it keeps all limits, jerk included"
    else:
        yield {"ruckig": Ruckig(), "quintic": Quintic()}, "the fastest back end that keeps all limits, jerk included"
    yield {"toppra, jerk_limited": Toppra(jerk_limited=True)}, "it keeps all limits, jerk included"
