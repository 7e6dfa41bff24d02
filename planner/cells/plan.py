"""Plans of several robots in one cell, on one clock: paths of their own, and waits where robots rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import inf
from time import monotonic

from planner.backends import as_backend
from planner.cells.clearance import ClearanceBetween, proved_between
from planner.cells.handovers import (
    Handover,
    faults_of_handovers,
    handed_over,
    handovers_of,
    in_scene,
    order_of_plans,
)
from planner.cells.making_way import Obstacles, has_free_motion, making_way
from planner.cells.meetings import CellMeeting, Meeting, faults_of_meetings, meetings_of, with_common_dwells
from planner.cells.movers import Mover, Rules
from planner.cells.robots import CellRobot, faults_of_pairs, faults_of_robots
from planner.cells.waits import Member, Pair, WaitSearch
from planner.certificate.clearance import parts_of, segment_checkers
from planner.certificate.moving_objects import clearances_of_objects
from planner.errors import ClearanceUnproved, Collision, InvalidProblem, PlanningError, StartInCollision
from planner.fields import FieldPath
from planner.planning.attempts import Budget
from planner.planning.plan import DEFAULT, plan
from planner.plans.result import Plan
from planner.problems.problem import PlanningProblem
from planner.scene import Scene
from planner.spatial import FloatArray
from planner.timing.arrivals import with_wait


@dataclass(frozen=True, eq=False)
class CellPlan:
    """The certified plans of the robots of a cell, which start together.

    Attributes:
        names: The names of the robots.
        plans: The plan of each robot. Its waits are dwells at waypoints.
        waits: For each robot, the wait at each requested waypoint before it goes on, s.
        clearances: The proved clearance of each pair of robots.
        meetings: The meetings with their times.
        unhindered: The duration of each robot's plan without waits, s.
    """

    names: tuple[str, ...]
    plans: tuple[Plan, ...]
    waits: tuple[tuple[float, ...], ...]
    clearances: tuple[ClearanceBetween, ...]
    meetings: tuple[CellMeeting, ...]
    unhindered: tuple[float, ...]

    @property
    def duration(self) -> float:
        """The time from the common start to the end of the last robot, s."""
        return max(plan.trajectory.duration for plan in self.plans)


def plan_cell(
    robots: Sequence[CellRobot],
    *,
    scene: Scene | None = None,
    margin: float = 0.0,
    skew: float = 0.0,
    meetings: Sequence[str] = (),
    allowed_pairs: Sequence[tuple[str, str]] = (),
    budget: Budget = DEFAULT,
) -> CellPlan:
    """Plan several robots in one world: each on its own path, with waits where it rests.

    The waits are chosen in the coordination diagram of each pair of robots. Two robots end as early as such waits
    allow, to the accuracy of the diagram. Three or four wait for each other in the best order of priority.

    Each robot is proved clear of the moving objects of the scene, with its waits and until the last robot ends.

    Where no waits keep the robots apart, robots with free motions are planned again, around the places where others
    rest at their start and end. A robot that takes part in a handover keeps to its path.

    At a meeting robots wait for each other: none goes on before all have arrived and rested for the longest of their
    dwells there. An object that one of them puts down there and another one takes moves on with the other one.

    Args:
        robots: The robots, two to four. Their names differ.
        scene: The objects around all robots. An object goes to a second robot only where both meet. None: there are
            none.
        margin: The least distance between robots, m.
        skew: The largest time by which the controller of one robot may start before or after that of another, s.
        meetings: Names of waypoints at which all robots with a waypoint of that name wait for each other, in the order
            of time.
        allowed_pairs: Pairs of bodies of two robots that may touch, by the names `robot/link` or `robot/object`. An
            object that changes hands is no obstacle to itself.
        budget: The bounds on the attempts at each plan, and on the time of all plans and of the search for waits. The
            search ends with the best waits so far.

    Raises:
        InvalidProblem: The cell or a problem contradicts itself.
        Collision: Robots touch where they start or end, or no waits keep them apart or are found in time.
        ClearanceUnproved: The clearance of waits that were found takes too long to prove.
        PlanningError: A robot has no plan of its own.

    Examples:
        >>> import numpy as np
        >>> import planner
        >>> left = planner.load_robot("ur5e")
        >>> right = left.derived(mounting=planner.Pose([2.5, 0.0, 0.0], np.eye(3)))
        >>> forth = [[0.0, -1.5, 1.5, 0.0, 0.5, 0.0], [1.0, -1.2, 1.2, 0.0, 0.5, 0.5]]
        >>> problems = [planner.PlanningProblem(robot, forth) for robot in (left, right)]
        >>> cell = planner.plan_cell([planner.CellRobot("left", problems[0]), planner.CellRobot("right", problems[1])])
        >>> cell.waits
        ((0.0, 0.0), (0.0, 0.0))
    """
    end = inf if budget.seconds is None else monotonic() + budget.seconds
    common = scene or Scene()
    met, faults = meetings_of(robots, meetings), list(faults_of_robots(robots, common, margin, skew))
    faults += faults_of_meetings(robots, meetings)
    faults += [*faults_of_pairs(robots, common, allowed_pairs), *faults_of_handovers(robots, met)]
    if faults:
        raise InvalidProblem(faults)
    robots, handovers = with_common_dwells(robots, met), handovers_of(robots, met)
    rules = Rules.of(margin, skew, [*allowed_pairs, *_one_object(robots, handovers)])
    given = {k for handover in handovers for k in (handover.giver, handover.taker)}
    free = [k for k, robot in enumerate(robots) if k not in given and has_free_motion(robot.problem)]

    def replan(k: int, obstacles: Obstacles) -> Plan | None:
        if monotonic() > end:
            return None
        left = replace(budget, seconds=None if end == inf else (end - monotonic()) / (len(robots) + 1))
        return _around(k, robots[k], in_scene(robots[k].problem, scene, ()), obstacles, left)

    alone = _alone(robots, scene, handovers, end, budget)
    try:
        members, waits, times = _coordinated(robots, alone, met, handovers, rules, end)
    except (Collision, ClearanceUnproved) as refusal:
        made = None if isinstance(refusal, StartInCollision) else making_way(robots, alone, free, rules, replan)
        if made is None:
            raise
        alone = made
        members, waits, times = _coordinated(robots, alone, met, handovers, rules, end)
    plans = [
        _with_waits(k, robot, own, member, wait, budget) if wait.any() else own
        for k, (robot, own, member, wait) in enumerate(zip(robots, alone, members, waits, strict=True))
    ]
    _prove_rests(robots, plans)
    proved = _movers(robots, plans, handovers).values()
    return CellPlan(
        tuple(robot.name for robot in robots),
        tuple(plans),
        tuple(member.by_waypoint(own, wait) for member, own, wait in zip(members, alone, waits, strict=True)),
        tuple(proved_between(one, other, rules) for one, other in proved),
        tuple(
            CellMeeting(own.name, {robots[k].name: stop for k, stop in own.stops.items()}, time)
            for own, time in zip(met, times, strict=True)
        ),
        tuple(own.trajectory.duration for own in alone),
    )


def _alone(
    robots: Sequence[CellRobot], scene: Scene | None, handovers: Sequence[Handover], end: float, budget: Budget
) -> list[Plan]:
    """Plan each robot without the others; one that gives an object comes before one that takes it.

    Raises:
        PlanningError: A robot has no plan.
    """
    plans: dict[int, Plan] = {}
    for k in order_of_plans(len(robots), handovers) or ():
        of_each = (end - monotonic()) / (len(robots) - len(plans) + 1)  # the last share is for the waits
        own = replace(budget, seconds=None if end == inf else max(0.0, of_each))
        arrived = [handed_over(handover, plans[handover.giver]) for handover in handovers if handover.taker == k]
        plans[k] = _plan(k, robots[k], in_scene(robots[k].problem, scene, arrived), own)
    return [plans[k] for k in range(len(robots))]


def _coordinated(
    robots: Sequence[CellRobot],
    alone: Sequence[Plan],
    met: Sequence[Meeting],
    handovers: Sequence[Handover],
    rules: Rules,
    end: float,
) -> tuple[list[Member], list[FloatArray], tuple[float, ...]]:
    """Return the robots on their own plans, their waits (rests,), s, and the times of meetings, s.

    Raises:
        Collision, ClearanceUnproved: No waits are proved to keep the robots apart.
    """
    members = [Member.of(own) for own in alone]
    passed = [{k: members[k].rest_at(alone[k], stop) for k, stop in own.stops.items()} for own in met]
    at_rests = [Meeting(own.name, stops) for own, stops in zip(met, passed, strict=True)]
    waits, times = WaitSearch(members, _movers(robots, alone, handovers), rules, at_rests, end).found()
    return members, waits, times


def _movers(
    robots: Sequence[CellRobot], plans: Sequence[Plan], handovers: Sequence[Handover]
) -> dict[Pair, tuple[Mover, Mover]]:
    """Return the movers of each pair of robots; the giver loses an object where the other one takes it."""

    def mover(k: int, other: int) -> Mover:
        gone = [handover.id for handover in handovers if (handover.giver, handover.taker) == (k, other)]
        return Mover.of_plan(robots[k].name, plans[k], gone)

    return {(i, j): (mover(i, j), mover(j, i)) for i, j in combinations(range(len(robots)), 2)}


def _prove_rests(robots: Sequence[CellRobot], plans: Sequence[Plan]) -> None:
    """Prove that robots which rest at their end keep clear of moving objects until the last robot ends.

    Raises:
        Collision, ClearanceUnproved: One does not, or that takes too long to prove.
    """
    end = max(plan.trajectory.duration for plan in plans)
    for k, (robot, own) in enumerate(zip(robots, plans, strict=True)):
        scene, trajectory = own.problem.scene, own.trajectory
        if scene is None or not scene.moving or trajectory.duration == end:
            continue
        resting = with_wait(trajectory, len(trajectory.arrivals) - 1, end - trajectory.duration)
        *_, last = parts_of(segment_checkers(own.problem, own.path.positions), resting)
        try:
            for _ in clearances_of_objects(last[0], scene.objects, last[1], last[2], None):
                pass
        except PlanningError as refusal:
            text = f"robot {robot.name!r} at rest at its end, until {end:.4g} s: {refusal._text}"
            moved = refusal.numbered(own.problem.numbers)
            raise moved.with_fields(_text=text, robot=k) from None


def _one_object(robots: Sequence[CellRobot], handovers: Sequence[Handover]) -> Iterator[tuple[str, str]]:
    """Yield the two names of each object that changes hands."""
    for handover in handovers:
        yield f"{robots[handover.giver].name}/{handover.id}", f"{robots[handover.taker].name}/{handover.id}"


def _plan(number: int, robot: CellRobot, problem: PlanningProblem, budget: Budget) -> Plan:
    """Plan one robot; a refusal names it.

    Raises:
        PlanningError: There is no plan.
    """
    try:
        return plan(problem, as_backend(robot.backend), budget)
    except InvalidProblem as refusal:
        faults = [(_field_in_cell(number, fault.field), fault.message) for fault in refusal.faults]
        raise InvalidProblem(faults) from None
    except PlanningError as refusal:
        text = f"robot {robot.name!r}: {refusal._text}"
        changes = (*refusal.remedies, *refusal.hints)  # planned without the other robots, so none is a remedy here
        hints = tuple(replace(change, field=_field_in_cell(number, change.field)) for change in changes)
        raise refusal.with_fields(_text=text, robot=number, remedies=(), hints=hints) from None


def _around(
    number: int, robot: CellRobot, problem: PlanningProblem, obstacles: Obstacles, budget: Budget
) -> Plan | None:
    """Plan one robot around obstacles, and then its path again without them; None: there is no plan."""
    try:
        own = _plan(number, robot, obstacles.around(problem), budget)
        return _again(number, robot, own, replace(own.problem, scene=problem.scene), budget)
    except PlanningError:
        return None


def _again(number: int, robot: CellRobot, own: Plan, problem: PlanningProblem, budget: Budget) -> Plan:
    """Plan a robot's fixed path again, in a changed problem."""
    # The path is as it is.
    fixed = replace(problem, optimise=None, time_budget=None, optimise_iterates=None, warm_start=None)
    found = _plan(number, robot, fixed, replace(budget, seconds=None))
    return replace(found, detours=own.detours, choices=own.choices, optimisation=own.optimisation)


def _field_in_cell(number: int, field: FieldPath) -> FieldPath:
    """Return the path in a cell to a field of a robot's problem; the common scene has objects and margin."""
    return field if field[:2] in {("scene", "objects"), ("scene", "margin")} else ("robots", number, *field)


def _with_waits(number: int, robot: CellRobot, own: Plan, member: Member, waits: FloatArray, budget: Budget) -> Plan:
    """Plan a robot's fixed path again, with waits (rests,), s, as dwells."""
    waypoints = list(own.problem.waypoints)
    for k, wait in zip(member.waypoints, waits.tolist(), strict=True):
        waypoints[k] = replace(waypoints[k], dwell=waypoints[k].dwell + wait)
    duration = None if own.problem.duration is None else own.problem.duration + float(waits.sum())
    return _again(number, robot, own, replace(own.problem, waypoints=waypoints, duration=duration), budget)
