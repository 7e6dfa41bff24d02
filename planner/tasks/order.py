"""Tasks in the order of the shortest certified duration that the search finds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from time import monotonic

import numpy as np

from planner.backends import as_backend
from planner.backends.base import BackEnd
from planner.backends.splines.cubic import Cubic
from planner.errors import InvalidProblem, PlanningError
from planner.planning.attempts import Attempt, Budget, Proposals, Refused, is_unmade, run
from planner.planning.better_detours import with_better_detours
from planner.planning.variants import planned
from planner.plans.result import Plan
from planner.problems.actions import Action
from planner.problems.motion_around import FreeMotion
from planner.problems.problem import AnyWaypoint, JointMotion, Motion, PlanningProblem
from planner.problems.transitions import StopTransition
from planner.robots.tools import with_tools
from planner.tasks.bound import least_duration
from planner.tasks.changes import ToolsOfTasks
from planner.tasks.costs import Costs
from planner.tasks.faults import in_tasks, refuse_faults
from planner.tasks.options import ChosenTask, combinations, with_options
from planner.tasks.rules import Rules
from planner.tasks.search import best_order
from planner.tasks.states import NoState, States, states_of_tasks
from planner.tasks.task import ChangeableTool, Origin, Task, Visit
from planner.tasks.travel import UNUSABLE, JointSpeeds

MOST_REPAIRS = 50
"""The largest number of orders that are planned: each refused motion, and each detour, may lead to another order."""

SHARE_OF_SEARCH = 0.7
"""The share of a time budget after which the search for an order ends; the rest is for its plan."""


@dataclass(frozen=True, eq=False)
class OrderedTasks:
    """Tasks in order, with their certified plan.

    Attributes:
        order: The indices of the tasks in the order of the plan.
        reversed: For each task in order, whether the robot visits its waypoints in the opposite direction.
        first: For each task in order, the index of the waypoint at which it begins.
        options: For each task in order, the index of the chosen option for each of its goal sets.
        origins: For each waypoint of `problem`, its task and its waypoint there.
        problem: The ordinary problem, whose waypoints are the tasks in order; free motions are as requested.
        plan: Its certified plan.
        bound: A lower bound on the duration of all orders, s. It compares the joint positions that the search knows.
        estimate: The duration that the search estimates for the order, s.
        planned_orders: The number of orders that were planned or refused.
    """

    order: tuple[int, ...]
    reversed: tuple[bool, ...]
    first: tuple[int, ...]
    options: tuple[tuple[int, ...], ...]
    origins: tuple[Origin, ...]
    problem: PlanningProblem
    plan: Plan
    bound: float
    estimate: float
    planned_orders: int

    @property
    def gap(self) -> float:
        """The share of the plan's duration above the lower bound, from 0 to 1."""
        return max(0.0, 1.0 - self.bound / self.plan.trajectory.duration)


def order_tasks(
    problem: PlanningProblem,
    tasks: Sequence[Task],
    backend: BackEnd | str = Cubic(),
    *,
    travel: Motion | None = None,
    seconds: float | None = None,
    tools: Sequence[ChangeableTool] = (),
    mounted: str | None = None,
) -> OrderedTasks:
    """Choose the order, the directions and the joint positions of tasks, and plan them.

    The search minimises an estimated duration: every joint motion takes as long as its slowest joint. A plan corrects
    the estimates of detours and of motions that are refused, and the search goes on.

    Args:
        problem: The robot, the limits and the scene. Its waypoints are the start and optionally the end.
        tasks: The tasks, one or more.
        backend: The back end that puts time on the path, or its kind.
        travel: The motion to the first waypoint of each task; None: a free motion in a scene, otherwise a joint motion.
        seconds: The time after which the search ends with the best order so far, s. None: no limit of time, so that
            equal requests have equal answers.
        tools: The tools of a tool changer, which tasks name. The robot changes them between tasks.
        mounted: The name of the tool that the robot has at the start and, if there is one, at the end; None: its own.

    Returns:
        The order and its plan, with a lower bound.

    Raises:
        InvalidProblem: A task contradicts itself, the other tasks or the robot.
        PlanningError: A task cannot be reached, or no order has a plan.
    """
    if travel is None:
        travel = JointMotion() if problem.scene is None else FreeMotion()
    tasks, backend, tools = tuple(tasks), as_backend(backend), tuple(tools)
    refuse_faults(problem, tasks, travel, backend, seconds, tools, mounted)
    ordering = _Ordering(problem, tasks, backend, travel, seconds, tools, mounted)
    return run(ordering.proposals(), Budget(MOST_REPAIRS * 10, seconds))


class _Ordering:
    def __init__(
        self,
        problem: PlanningProblem,
        tasks: tuple[Task, ...],
        backend: BackEnd,
        travel: Motion,
        seconds: float | None,
        tools: tuple[ChangeableTool, ...],
        mounted: str | None,
    ) -> None:
        self.problem, self.backend, self.travel = problem, backend, travel
        self.given, self.tools = tasks, ToolsOfTasks.of(problem, tasks, tools, mounted)
        self.tasks = self.tools.tasks
        self.robots = with_tools(problem.robot, self.tools.points)
        self.has_end = len(problem.waypoints) > 1
        self.began = monotonic()
        self.deadline = inf if seconds is None else self.began + SHARE_OF_SEARCH * seconds
        every = [
            waypoint
            for task in self.tasks
            for options in combinations(task)
            for waypoint in with_options(problem, task, options).task.waypoints
        ]
        stops = all(isinstance(waypoint.transition, StopTransition) for waypoint in every)
        speeds = JointSpeeds.of(problem, stops=stops)
        arrivals = np.array([task.arrival for task in self.tasks])
        self.costs = Costs(self._states(speeds), speeds, arrivals, self.tools, has_end=self.has_end)
        self.rules = Rules.of(self.tools.ordered)

    def _states(self, speeds: JointSpeeds) -> States:
        try:
            start = states_of_tasks(self.problem, self.tasks[:1], self.robots[:1], None, speeds)
            near = start.entries[0] if len(start.entries) == 1 else None
            return states_of_tasks(self.problem, self.tasks, self.robots, near, speeds)
        except NoState as none:
            chosen = with_options(self.problem, self.tasks[none.task], none.options)
            raise in_tasks(
                none.refusal, self.given, self.tools.changeable, self._origins(none.task, chosen, Visit())
            ) from None

    def proposals(self) -> Proposals[OrderedTasks]:
        """Plan the best order, and others where plans show that the estimate of a motion is wrong."""
        chosen = best_order(self.costs, self.rules, self.deadline)
        least = least_duration(self.costs, self.costs.total(chosen))
        best: OrderedTasks | None = None
        refusal: PlanningError | None = None
        for count in range(1, MOST_REPAIRS + 1):
            estimate = self.costs.total(chosen)
            if estimate >= UNUSABLE:
                break
            whole = self.costs.with_changes(chosen)
            problem, origins = self._ordered(whole)
            outcome = yield from with_better_detours(planned(Attempt(problem, self.backend)))
            if is_unmade(outcome):
                break
            if isinstance(outcome, Refused):
                refusal = in_tasks(outcome.refusal, self.given, self.tools.changeable, origins)
                if not self._corrected(whole, origins, outcome.refusal):
                    break
            else:
                plan = outcome.plan
                if best is None or plan.trajectory.duration < best.plan.trajectory.duration:
                    best = self._result(chosen, origins, problem, plan, least, estimate, count)
                self._learn(whole, origins, plan)
            other = best_order(self.costs, self.rules, self.deadline, chosen)
            if isinstance(outcome, Refused) or self.costs.total(other) < self.costs.total(chosen):
                chosen = other
            else:
                break
        if best is None:
            assert refusal is not None  # noqa: S101 - the first attempt always runs
            raise refusal
        return replace(best, planned_orders=count)

    def _ordered(self, chosen: np.ndarray) -> tuple[PlanningProblem, tuple[Origin, ...]]:
        """Return the ordinary problem of states in order, changes of the tool included, and its waypoints' origins."""
        waypoints: list[AnyWaypoint] = []
        actions: list[Action] = []
        origins: list[Origin] = []
        before: int | None = None
        for state in chosen.tolist():
            index, visit = int(self.costs.states.tasks[state]), self.costs.states.visits[state]
            option = with_options(self.problem, self.tasks[index], visit.options)
            task = option.task
            motion = task.waypoints[0].motion if index in (0, self.tools.end) else self.travel
            actions += task.actions_after(len(waypoints))
            first, *others = task.visited(visit, motion, self.costs.states.positions[state])
            waypoints += [replace(first, tool=self.tools.new_point(before, index)), *others]
            before = index
            origins += self._origins(index, option, visit)
        return replace(self.problem, waypoints=waypoints, actions=actions), tuple(origins)

    def _origins(self, index: int, chosen: ChosenTask, visit: Visit) -> list[Origin]:
        """Return the origins of the waypoints of a task with its options on a visit."""

        def requested(step: int) -> int:
            return int(chosen.paths[step][1])

        steps = zip(chosen.task.steps(visit), chosen.task.motions(visit), strict=True)
        return [
            self.tools.origin(index, requested(step), motion if motion is None else requested(motion), option)
            for step, motion in steps
            for option in [chosen.paths[step][2:]]
        ]

    def _result(
        self,
        chosen: np.ndarray,
        origins: tuple[Origin, ...],
        problem: PlanningProblem,
        plan: Plan,
        least: float,
        estimate: float,
        count: int,
    ) -> OrderedTasks:
        inner = chosen[1:-1]
        visits = [self.costs.states.visits[state] for state in inner.tolist()]
        return OrderedTasks(
            tuple((self.costs.states.tasks[inner] - 1).tolist()),
            tuple(visit.is_reversed for visit in visits),
            tuple(visit.first for visit in visits),
            tuple(visit.options for visit in visits),
            origins,
            problem,
            plan,
            least,
            estimate,
            count,
        )

    def _corrected(self, chosen: np.ndarray, origins: Sequence[Origin], refusal: PlanningError) -> bool:
        """Exclude the motion or the state that a refusal names; return whether there is one."""
        at = refusal.waypoint if refusal.segment is None else refusal.segment + 1
        if isinstance(refusal, InvalidProblem) or at is None or not 0 <= at < len(origins):
            return False
        states, first = self._of_waypoints(chosen)
        if refusal.segment is not None and first[at]:
            self.costs.set_known(states[at - 1], states[at], UNUSABLE)
        elif origins[at].task is None and origins[at].tool is None:
            return False
        else:
            self.costs.exclude(states[at])
        return True

    def _of_waypoints(self, chosen: np.ndarray) -> tuple[list[int], list[bool]]:
        """Return for each waypoint of the ordered problem its state, and whether it is the first one of its task."""
        states: list[int] = []
        first: list[bool] = []
        for state in chosen.tolist():
            count = len(self.costs.states.positions[state])
            states += [state] * count
            first += [True] + [False] * (count - 1)
        return states, first

    def _learn(self, chosen: np.ndarray, origins: Sequence[Origin], plan: Plan) -> None:
        """Correct the durations of detours between tasks by their plan."""
        states, first = self._of_waypoints(chosen)
        numbers = np.array(plan.problem.numbers)
        for detour in plan.detours:
            at = detour.waypoint
            if not detour.has_corners or not first[at] or at >= len(origins):
                continue
            begin, end = (int(np.flatnonzero(numbers == number)[-1]) for number in (at - 1, at))
            duration = float(plan.trajectory.arrivals[end] - plan.trajectory.departures[begin])
            self.costs.set_known(states[at - 1], states[at], duration)
