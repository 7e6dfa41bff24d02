"""Jobs: requests with known answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from benchmarks.corpus.programme import Programme
    from planner.limits import Limits
    from planner.problems.actions import Action
    from planner.problems.problem import PlanningProblem
    from planner.spatial import FloatArray

Law = Literal["cubic", "quintic", "trapezoidal", "s_curve"]
"""The motion profiles whose times are known in closed form."""

LEAST_BUDGET = 1.0
"""s of processor time that any plan may take."""

BUDGET_PER_WAYPOINT = 0.005
"""s of processor time that every waypoint adds: 300 take 1.5 s, 1,000 take 5 s."""


@dataclass(frozen=True, eq=False)
class Job:
    """One request, and the known properties of its answer, found without the planner.

    Attributes:
        name: The family, a number and the arm.
        family: The kind of work.
        parameters: The family's parameters.
        problem: The request.
        positions: (waypoints, joints), rad or m: of a continuous motion that does the job within all position limits.
            Found without the planner; None: unknown, or there is none.
        durations: s, in closed form, of each profile that has one.
        least_duration: s; no motion is faster.
        most_duration: s; a motion that takes longer has been slowed by something else than its limits.
        infeasible: Why there is no such motion, as an independent check has found; None: there is one.
        codes: The refusals that say so truly.
        twin: Name of a job that takes as long: mirrored, or without a waypoint that changes nothing.
    """

    name: str
    family: str
    parameters: dict[str, object]
    problem: PlanningProblem
    positions: FloatArray | None = None
    durations: dict[Law, float] | None = None
    least_duration: float | None = None
    most_duration: float | None = None
    infeasible: str | None = None
    codes: tuple[str, ...] = ()
    twin: str | None = None

    @property
    def budget(self) -> float:
        """Processor time, s, that a back end may take."""
        count = sum(1 + len(getattr(waypoint.motion, "poses", ())) for waypoint in self.problem.waypoints)
        return max(LEAST_BUDGET, BUDGET_PER_WAYPOINT * count)


@dataclass(frozen=True, eq=False)
class Draft:
    """A variant of a family at a place: a programme and its options.

    Attributes:
        programme: With the positions that were traced.
        parameters: The parameters of the family.
        limits: Of the whole; None: the robot's.
        carries: Share of the arm's greatest payload.
        only_seams: Nothing but lines and circles at their speeds: then length over speed tells the duration.
        twin: The number of the variant that takes as long.
        durations: As a job's.
        actions: The outputs and waits beside the motion.
    """

    programme: Programme
    parameters: dict[str, object]
    limits: Limits | None = None
    carries: float = 0.0
    only_seams: bool = False
    twin: int | None = None
    durations: dict[Law, float] | None = None
    actions: tuple[Action, ...] = ()
