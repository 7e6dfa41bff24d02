"""Plans of several robots in one cell, on one clock: fixed paths, and waits where robots rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import inf
from time import monotonic

import numpy as np

from planner.backends import as_backend
from planner.backends.base import BackEnd
from planner.backends.splines.cubic import Cubic
from planner.cells.clearance import ClearanceBetween, clearance_between
from planner.cells.coordination import coordinated
from planner.cells.diagram import Axis, Diagram
from planner.cells.movers import Mover
from planner.errors import ClearanceUnproved, Collision, InvalidProblem, PlanningError, StartInCollision
from planner.fields import FieldPath
from planner.planning.attempts import Budget
from planner.planning.plan import DEFAULT, plan
from planner.plans.result import Plan
from planner.problems.any_of import AnyOf, WaypointSequence
from planner.problems.problem import AnyWaypoint, PlanningProblem, ViaWaypoint
from planner.problems.transitions import StopTransition
from planner.scene import Scene
from planner.spatial import FloatArray

MOST_ROBOTS = 4
"""The largest number of robots of a cell."""

CELLS_OF_LONGEST = (128, 256)
"""Number of cells of the longest trajectory, in each of the searches for waits."""

BLOCKS_OF_WAITS = 2_000
"""The largest number of decided blocks of a pair while waits are chosen: waits that need more become longer."""

WAIT_ACCURACY = 1e-3
"""Accuracy of waits, s: they are shortened until so much less breaks a margin."""


@dataclass(frozen=True, eq=False)
class CellRobot:
    """A robot of a cell with its problem.

    Attributes:
        name: Its name in the cell.
        problem: Its waypoints and limits. The mounting of its robot is its base in the world. Its scene has its
            attached objects and allowed pairs, and no objects.
        backend: The back end that puts time on its path, or its kind.
    """

    name: str
    problem: PlanningProblem
    backend: BackEnd | str = Cubic()


@dataclass(frozen=True, eq=False)
class CellPlan:
    """The certified plans of the robots of a cell, which start together.

    Attributes:
        names: The names of the robots.
        plans: The plan of each robot. Its waits are dwells at waypoints.
        waits: For each robot, the wait at each requested waypoint before it goes on, s.
        clearances: The proved clearance of each pair of robots.
        unhindered: The duration of each robot's plan without waits, s.
    """

    names: tuple[str, ...]
    plans: tuple[Plan, ...]
    waits: tuple[tuple[float, ...], ...]
    clearances: tuple[ClearanceBetween, ...]
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
    budget: Budget = DEFAULT,
) -> CellPlan:
    """Plan several robots in one world: each on its own path, with waits where it rests.

    The waits are chosen in the coordination diagram of each pair of robots. Two robots end as early as such waits
    allow, to the accuracy of the diagram. Three or four wait for each other in the best order of priority.

    Args:
        robots: The robots, two to four. Their names differ.
        scene: The objects around all robots. Each object is taken by one robot at most. None: there are none.
        margin: The least distance between robots, m.
        skew: The largest time by which the controller of one robot may start before or after that of another, s.
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
    robots, end = tuple(robots), inf if budget.seconds is None else monotonic() + budget.seconds
    if faults := list(_faults(robots, scene or Scene(), margin, skew)):
        raise InvalidProblem(faults)
    alone = []
    for k, robot in enumerate(robots):
        of_each = (end - monotonic()) / (len(robots) - k + 1)  # the last share is for the waits
        own = replace(budget, seconds=None if end == inf else max(0.0, of_each))
        alone.append(_plan(k, robot, _in_scene(robot.problem, scene), own))
    members = [_Member.of(robot.name, own) for robot, own in zip(robots, alone, strict=True)]
    waits = _waits(members, margin, skew, end)
    plans = [
        _with_waits(k, robot, own, member, wait, budget) if wait.any() else own
        for k, (robot, own, member, wait) in enumerate(zip(robots, alone, members, waits, strict=True))
    ]
    movers = [Mover.of_plan(robot.name, own) for robot, own in zip(robots, plans, strict=True)]
    clearances = [clearance_between(one, other, margin=margin, skew=skew) for one, other in combinations(movers, 2)]
    return CellPlan(
        tuple(robot.name for robot in robots),
        tuple(plans),
        tuple(member.by_waypoint(own, wait) for member, own, wait in zip(members, alone, waits, strict=True)),
        tuple(clearances),
        tuple(own.trajectory.duration for own in alone),
    )


@dataclass(frozen=True, eq=False)
class _Member:
    """A robot of a cell on its trajectory without waits.

    Attributes:
        mover: The robot.
        waypoints: (rests,), the waypoint of its plan at each rest; the last one is its end.
        rests: (rests,), s: when it leaves these waypoints, and when it ends.
    """

    mover: Mover
    waypoints: tuple[int, ...]
    rests: FloatArray

    @classmethod
    def of(cls, name: str, own: Plan) -> _Member:
        waypoints, last = own.problem.waypoints, len(own.problem.waypoints) - 1
        stops = [
            k
            for k, waypoint in enumerate(waypoints)
            if k in (0, last)
            or (isinstance(waypoint.transition, StopTransition) and not isinstance(waypoint, ViaWaypoint))
        ]
        times = own.trajectory.departures[stops]
        times[-1] = own.trajectory.duration
        is_later = np.append(np.diff(times) > 0.0, True)
        return cls(Mover.of_plan(name, own), tuple(np.array(stops)[is_later].tolist()), np.asarray(times[is_later]))

    def by_waypoint(self, own: Plan, waits: FloatArray) -> tuple[float, ...]:
        """Return the waits (rests,) by requested waypoint."""
        numbers = own.requested_indices
        found = [0.0] * (max(numbers) + 1)
        for waypoint, wait in zip(self.waypoints, waits.tolist(), strict=True):
            found[numbers[waypoint]] += wait
        return tuple(found)


def _faults(robots: Sequence[CellRobot], scene: Scene, margin: float, skew: float) -> Iterator[tuple[FieldPath, str]]:
    if not 2 <= len(robots) <= MOST_ROBOTS:
        yield ("robots",), f"a cell must have 2 to {MOST_ROBOTS} robots; got {len(robots)}"
    for name, value in (("margin", margin), ("skew", skew)):
        if not 0.0 <= value < np.inf:
            yield (name,), f"must be finite and 0 or more; got {value:g}"
    seen: dict[str, int] = {}
    for k, robot in enumerate(robots):
        if robot.name in seen:
            yield ("robots", k, "name"), f"must differ from the name of robot {seen[robot.name]}; got {robot.name!r}"
        seen.setdefault(robot.name, k)
    for name in ("attached", "allowed_pairs", "pair_margins"):
        if getattr(scene, name):
            yield ("scene", name), "must be empty: each robot has its own"
    for i, thing in enumerate(scene.objects):
        if thing.motion is not None:
            yield ("scene", "objects", i, "motion"), "must be left out: the objects of a cell are static"
    takers: dict[str, str] = {}
    for k, robot in enumerate(robots):
        if robot.problem.scene is not None and robot.problem.scene.objects:
            yield ("robots", k, "scene", "objects"), "must be empty: the scene of the cell has the objects"
        taken = [pair for i, waypoint in enumerate(robot.problem.waypoints) for pair in _taken(waypoint, i)]
        for field, name in taken:
            if name in takers:
                other = f"robot {takers[name]!r} takes {name!r}, too"
                yield ("robots", k, *field), f"must be an object that no other robot takes; {other}"
        takers |= {name: robot.name for _, name in taken if name not in takers}


def _taken(waypoint: AnyWaypoint | WaypointSequence, *steps: str | int) -> Iterator[tuple[FieldPath, str]]:
    """Yield the fields and the names of the objects that a robot takes at a waypoint, or at its options."""
    if isinstance(waypoint, AnyOf):
        for i, option in enumerate(waypoint.options):
            yield from _taken(option, *steps, "options", i)
    elif isinstance(waypoint, WaypointSequence):
        for i, inner in enumerate(waypoint.waypoints):
            yield from _taken(inner, *steps, "waypoints", i)
    else:
        yield from ((("waypoints", *steps, "attach", i, "id"), take.id) for i, take in enumerate(waypoint.attach))


def _in_scene(problem: PlanningProblem, scene: Scene | None) -> PlanningProblem:
    """Return a robot's problem with the objects around all robots, and the larger margin."""
    if scene is None:
        return problem
    own = problem.scene or Scene()
    return replace(problem, scene=replace(own, objects=scene.objects, margin=max(own.margin, scene.margin)))


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


def _field_in_cell(number: int, field: FieldPath) -> FieldPath:
    """Return the path in a cell to a field of a robot's problem; the common scene has objects and margin."""
    return field if field[:2] in {("scene", "objects"), ("scene", "margin")} else ("robots", number, *field)


def _with_waits(number: int, robot: CellRobot, own: Plan, member: _Member, waits: FloatArray, budget: Budget) -> Plan:
    """Plan a robot's fixed path again, with waits (rests,), s, as dwells."""
    waypoints = list(own.problem.waypoints)
    for k, wait in zip(member.waypoints, waits.tolist(), strict=True):
        waypoints[k] = replace(waypoints[k], dwell=waypoints[k].dwell + wait)
    duration = None if own.problem.duration is None else own.problem.duration + float(waits.sum())
    fixed = replace(own.problem, optimise=None, time_budget=None, optimise_iterates=None)  # the path is as it is
    found = _plan(number, robot, replace(fixed, waypoints=waypoints, duration=duration), replace(budget, seconds=None))
    return replace(found, detours=own.detours, choices=own.choices, optimisation=own.optimisation)


def _waits(members: Sequence[_Member], margin: float, skew: float, end: float) -> list[FloatArray]:
    """Find waits (rests,) of each robot, s, that are proved to keep the robots apart.

    The search ends at a time on the monotonic clock, s.

    Raises:
        Collision: No waits do, or none are found in time.
        ClearanceUnproved: None are found.
    """
    none = [np.zeros(len(member.rests)) for member in members]
    refusal = _refused(members, none, margin, skew)
    if refusal is None:
        return none
    if isinstance(refusal, StartInCollision):
        raise refusal
    for count in CELLS_OF_LONGEST:
        if monotonic() > end:
            break
        step = max(member.mover.duration for member in members) / count
        axes = tuple(Axis(member.mover, step, member.rests) for member in members)
        pairs = combinations(range(len(axes)), 2)
        diagrams = {(i, j): Diagram.of(axes[i], axes[j], margin, end) for i, j in pairs}
        found = coordinated(axes, diagrams, int(np.ceil(skew / step)))
        if found is None:
            continue
        waits = [own.astype(np.float64) * step for own in found]
        for axis, own in zip(axes, waits, strict=True):
            own[1:-1] += (axis.counts * step - np.diff(axis.rests))[:-1]
        if _refused(members, waits, margin, skew) is None:
            return _shortened(members, waits, margin, skew, end)
    reason = "no waits where the robots rest keep them apart"
    if monotonic() > end:
        reason = "no waits that keep the robots apart were found in time"
    raise refusal.with_fields(_text=f"{reason}; without waits: {refusal._text}")


def _refused(
    members: Sequence[_Member], waits: Sequence[FloatArray], margin: float, skew: float
) -> Collision | ClearanceUnproved | None:
    """Return the refusal of robots with waits; None: they are proved to keep clear of each other."""
    movers = [member.mover.waiting(member.rests, own) for member, own in zip(members, waits, strict=True)]
    for one, other in combinations(movers, 2):
        try:
            clearance_between(one, other, margin=margin, skew=skew, tolerance=None, blocks=BLOCKS_OF_WAITS)
        except (Collision, ClearanceUnproved) as refusal:
            return refusal
    return None


def _shortened(
    members: Sequence[_Member], waits: Sequence[FloatArray], margin: float, skew: float, end: float
) -> list[FloatArray]:
    """Shorten waits as far as the robots are proved to keep clear, until an end on the clock."""
    best = [own.copy() for own in waits]
    for k, own in enumerate(waits):
        for rest in np.flatnonzero(own > 0.0).tolist():
            low, high = 0.0, float(own[rest])
            if monotonic() > end:
                return best
            best[k][rest] = low
            if _refused(members, best, margin, skew) is None:
                continue
            while high - low > WAIT_ACCURACY and monotonic() <= end:
                best[k][rest] = (low + high) / 2.0
                if _refused(members, best, margin, skew) is None:
                    high = best[k][rest]
                else:
                    low = best[k][rest]
            best[k][rest] = high
    return best
