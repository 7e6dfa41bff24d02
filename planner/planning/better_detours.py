"""Plans of problems with free motions whose ways are made better once they are found, as long as is asked."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from time import monotonic
from typing import TYPE_CHECKING

from planner.errors import PlanningError
from planner.free_motion.better_ways import BetterWays
from planner.free_motion.edges import FreeEdges
from planner.free_motion.objectives import Estimate, value_of
from planner.free_motion.ways import Gain, asked_indices, ends_of_way, free_waypoints, with_ways
from planner.paths import solve_path
from planner.planning.detours import LADDER, plan_around
from planner.plans.result import certified, timed
from planner.problems.motion_around import OPTIMISE_CHECKS, FreeMotion
from planner.tolerances import ROUNDING

if TYPE_CHECKING:
    from planner.backends.base import BackEnd
    from planner.free_motion.ways import FoundWay
    from planner.plans.result import Plan
    from planner.problems.motion_around import Objective
    from planner.problems.problem import PlanningProblem
    from planner.problems.transitions import Transition
    from planner.spatial import FloatArray


def plan_free_motions(problem: PlanningProblem, backend: BackEnd) -> Plan:
    """Plan a problem with free motions, free of faults, and make those of its ways better of which that is asked.

    Each in its turn is made better while the others stay. A straight way stays as it is.

    Args:
        problem: What is asked.
        backend: What puts time on the path.

    Returns:
        The plan, where one way is made better no worse by its objective than that of `plan_around`; its `ways` have
        what was gained.

    Raises:
        NoPathFound: There is no way, or none was found.
        PlanningError: Another refusal; its indices are those of the problem asked.
    """
    end = monotonic()
    plan = plan_around(problem, backend)
    for number, index in enumerate(free_waypoints(problem)):
        motion = problem.waypoints[index].motion
        if isinstance(motion, FreeMotion) and motion.optimise is not None:
            end += motion.time_budget or 0.0
            until = inf if motion.time_budget is None else end
            most = OPTIMISE_CHECKS if motion.time_budget is None else inf
            improvement = _Improvement(problem, backend, plan, number, motion.optimise)
            plan = improvement.within(motion.optimise_checks or most, until)
    return plan


class _Improvement:
    """Makes one way of a plan better.

    Attributes:
        plan: The best so far.
        value: Its value.
    """

    def __init__(
        self, problem: PlanningProblem, backend: BackEnd, plan: Plan, number: int, objective: Objective
    ) -> None:
        self._problem, self._backend, self._number = problem, backend, number
        self._objective: Objective = objective
        self.plan = plan
        self.value = value_of(objective, plan.path, plan.trajectory)

    def within(self, most: float, until: float) -> Plan:
        """Return the best plan that is found among so many motions, until a time on the monotonic clock, s."""
        first, way = self.value, self.plan.ways[self._number]
        candidates = checks = 0
        if way.has_corners:
            ways, longest = self._ways(most, until), 0.0
            for positions in ways:
                begun = monotonic()
                if begun + longest > until:
                    break
                candidates += 1
                if self._is_better(positions, until):
                    ways.best = positions
                longest = max(longest, monotonic() - begun)
            checks = ways.edges.checked
        gain = Gain(self._objective, first, self.value, candidates, checks)
        return self._with(replace(self.plan.ways[self._number], gain=gain))

    def _ways(self, most: float, until: float) -> BetterWays:
        """Return where other ways come from. Only after the last free motion no other way begins where it ends."""
        ways, way = self.plan.ways, self.plan.ways[self._number]
        ends = ends_of_way(self._problem, ways[: self._number], way.waypoint)
        if self._number < len(ways) - 1:
            ends = ends._replace(goals=way.positions[-1:])
        edges = FreeEdges(self._problem.robot, ends.checker, most)
        edges.until = until
        segment = asked_indices(self._problem, ways).index(way.waypoint) - 1
        cost = Estimate(self._objective, self.plan.path, segment)
        seed = self._problem.inverse_kinematics.seed
        return BetterWays(self._problem.robot, ends, way.positions, cost, edges, seed)

    def _is_better(self, positions: FloatArray, until: float) -> bool:
        """Time and certify a way (positions, joints) on the ladder; keep the plan if it is better."""
        before = self.value
        for transition in LADDER:
            if monotonic() > until or not self._refuses(positions, transition):
                break
        return self.value < before

    def _refuses(self, positions: FloatArray, transition: Transition) -> bool:
        """Plan along a way, and keep the plan if it is better; tell whether one is refused that would be."""
        ways = list(self.plan.ways)
        ways[self._number] = replace(ways[self._number], positions=positions, transition=transition, gain=None)
        current = with_ways(self._problem, ways)
        try:
            path = solve_path(current)
            trajectory = timed(current, self._backend, path)
            value = value_of(self._objective, path, trajectory)
            if value < self.value * (1.0 - ROUNDING):
                self.plan = replace(certified(current, self._backend, path, trajectory), ways=tuple(ways))
                self.value = value
        except PlanningError:
            return True
        return False

    def _with(self, way: FoundWay) -> Plan:
        ways = self.plan.ways
        return replace(self.plan, ways=(*ways[: self._number], way, *ways[self._number + 1 :]))
