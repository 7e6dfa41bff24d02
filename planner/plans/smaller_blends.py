"""Blends that would collide are made smaller until they are free."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from planner.errors import Collision, PlanningError
from planner.paths import solve_path
from planner.plans.result import Plan, certified_plan
from planner.problems.transitions import BlendTransition
from planner.trajectories.trajectory import PlanWarning

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.backends.base import BackEnd
    from planner.paths import JointPath
    from planner.problems.problem import PlanningProblem

LEAST_SHARE = 1.0 / 32.0
"""Share of the radius asked for below which no blend is tried: a robot that turns as sharply as that nearly stops."""

FINENESS = 0.1
"""How near the largest free blend is found, as a share of its radius: each halving of that takes another plan."""

MOST_PLANS = 40
"""Number of plans that are made for the blends of one problem: seven at most for one blend, with room for several."""


def blend_radii(problem: PlanningProblem) -> dict[int, float]:
    """Return the radii of the blends, m, by the indices of their waypoints."""
    transitions = enumerate(waypoint.transition for waypoint in problem.waypoints)
    return {i: transition.radius for i, transition in transitions if isinstance(transition, BlendTransition)}


def with_blend_radii(problem: PlanningProblem, radii: Mapping[int, float]) -> PlanningProblem:
    """Return the problem with other radii, m, of some of its blends, by the indices of their waypoints."""
    waypoints = list(problem.waypoints)
    for i, radius in radii.items():
        waypoints[i] = replace(waypoints[i], transition=BlendTransition(radius))
    return replace(problem, waypoints=waypoints)


def plan_with_free_blends(problem: PlanningProblem, backend: BackEnd, path: JointPath) -> Plan:
    """Plan a problem with its blends, or where these collide with the largest smaller ones that are proved free.

    Args:
        problem: What is asked, free of faults and without free motions.
        backend: What puts time on the path.
        path: The solved path of the problem.

    Returns:
        The plan; where blends are smaller its problem has them, and a warning names each.

    Raises:
        Collision: The robot collides with the smallest blends, too, or elsewhere: the refusal of what was asked.
        PlanningError: Another refusal.
    """
    try:
        return certified_plan(problem, backend, path)
    except Collision as refusal:
        plan = _Search(problem, backend).plan_after(refusal)
        if plan is None:
            raise
        return plan


class _Search:
    """The search for the largest free radii: all that collide are made small, then one after the other larger again."""

    def __init__(self, problem: PlanningProblem, backend: BackEnd) -> None:
        self.problem, self.backend = problem, backend
        self.asked = blend_radii(problem)
        self.pairs: dict[int, tuple[str, str]] = {}
        self.plans_left = MOST_PLANS

    def plan_after(self, refusal: Collision) -> Plan | None:
        """Return the plan with smaller blends, and warnings that say so; None: it is refused with the smallest, too."""
        plan = self._smallest(refusal)
        if plan is None:
            return None
        for corner in sorted(self.pairs):
            plan = self._largest_at(corner, plan)
        return replace(plan, warnings=(*self._warnings(plan), *plan.warnings))

    def _smallest(self, refusal: Collision) -> Plan | None:
        """Return a plan with the smallest blends at both ends of motions on which the robot collides."""
        found: Plan | PlanningError = refusal
        while isinstance(found, Collision) and self.plans_left:
            ends = () if found.segment is None else (found.segment, found.segment + 1)
            corners = self.asked.keys() & ends - self.pairs.keys()
            if not corners:
                return None
            self.pairs |= dict.fromkeys(corners, found.pair)
            found = self._tried({corner: self.asked[corner] * LEAST_SHARE for corner in self.pairs})
        return found if isinstance(found, Plan) else None

    def _largest_at(self, corner: int, plan: Plan) -> Plan:
        """Return the plan with the largest free radius at a corner: the one asked for, if another blend collided."""
        radii = blend_radii(plan.problem)
        refused = self.asked[corner]
        trial = refused if len(self.pairs) > 1 else (radii[corner] * refused) ** 0.5
        while refused > radii[corner] * (1.0 + FINENESS) and self.plans_left:
            found = self._tried(radii | {corner: trial})
            if isinstance(found, Plan):
                plan, radii[corner] = found, trial
            else:
                refused = trial
                if isinstance(found, Collision):
                    self.pairs[corner] = found.pair
            trial = (radii[corner] * refused) ** 0.5
        return plan

    def _tried(self, radii: Mapping[int, float]) -> Plan | PlanningError:
        self.plans_left -= 1
        smaller = with_blend_radii(self.problem, radii)
        try:
            return certified_plan(smaller, self.backend, solve_path(smaller))
        except PlanningError as refusal:
            return refusal

    def _warnings(self, plan: Plan) -> Iterator[PlanWarning]:
        """Yield what is said of blends that are smaller than asked."""
        for corner, radius in blend_radii(plan.problem).items():
            if radius < self.asked[corner]:
                first, second = self.pairs[corner]
                within = f"waypoint {corner} is blended within {radius:.6g} m in place of {self.asked[corner]:g} m"
                message = f"{within}, with which {first} would be too near to {second}"
                yield PlanWarning("blend_reduced", message)
