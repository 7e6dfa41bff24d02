"""The joint positions that one waypoint may be given: a layer, through which the way is sought."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.errors import JointPositionLimit, PlanningError, Remedy, UnreachableWaypoint, distinct
from planner.kinematics.configurations import Configuration, configurations, in_configuration
from planner.kinematics.descent import TABLE_ROWS
from planner.kinematics.forward import LEAST_MANIPULABILITY, manipulability
from planner.kinematics.inverse import IsFree
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.search import QUICK, Search, is_isolated
from planner.kinematics.turns import TURN, turns_within
from planner.robots import Robot
from planner.spatial import FloatArray, Pose
from planner.tolerances import POSITION_TOLERANCE, ROUNDING
from planner.waypoints.pinned import Pinned
from planner.waypoints.preferences import with_still_axes

MOST_OF_CONTINUUM = 8
"""The most solutions of a continuum sought from starts in the requested configuration."""

MOST_STARTS = 64
"""The most starts from which they are sought."""


def solutions_in(
    robot: Robot,
    pose: Pose,
    solutions: tuple[FloatArray, ...],
    wanted: Configuration,
    options: InverseKinematicsOptions,
) -> tuple[FloatArray, ...]:
    """Return the solutions of a pose in the requested configuration.

    A continuum has more than the spread that is known of it: further solutions are sought from starts in that
    configuration.
    """
    fitting = in_configuration(robot, solutions, wanted)
    if len(fitting) == len(solutions) or is_isolated(robot, pose, solutions[0]):
        return fitting
    search, found = Search(robot, pose, options), list(fitting)
    for start in in_configuration(robot, search.table_starts(TABLE_ROWS - 1), wanted)[:MOST_STARTS]:
        if len(found) >= MOST_OF_CONTINUUM:
            break
        q = search.solve(start, QUICK)
        found += [] if q is None else in_configuration(robot, [q], wanted)
    return tuple(found)


def configuration_error(
    robot: Robot,
    index: int,
    pose: Pose,
    solutions: Sequence[FloatArray],
    wanted: Configuration,
    options: InverseKinematicsOptions,
) -> PlanningError:
    """Build the refusal of a reachable pose without a solution in the requested configuration; it names the others."""
    found = list(dict.fromkeys(configurations(robot, np.array(solutions))))
    others = "; ".join(map(str, found))
    changed = dict.fromkeys(other.of_parts(wanted.names) for other in found)
    remedies = [
        Remedy(("waypoints", index, "configuration"), other, f"the waypoint can be reached with {other}")
        for other in sorted(changed, key=lambda other: len(other.names.items() - wanted.names.items()))
    ]
    q = Search(robot, pose, options).beyond_the_limits(wanted)
    if q is None:
        return UnreachableWaypoint(
            f"no joint position of {robot.id} reaches waypoint {{waypoint}} with {wanted}; "
            f"it can be reached with {others}",
            waypoint=index,
            remedies=remedies,
        )
    excess = np.maximum(robot.limit("lower") - q, q - robot.limit("upper"))
    joint = robot.joints[int(excess.argmax())]
    value = float(q[excess.argmax()])
    limit = float(joint.lower if value < joint.lower else joint.upper)
    there, end = distinct(value, limit)
    return JointPositionLimit(
        f"with {wanted} waypoint {{waypoint}} can be reached only with {joint.name} at {there}, its limit is {end}; "
        f"it can be reached with {others}",
        waypoint=index,
        joint=joint.name,
        value=value,
        limit=limit,
        remedies=remedies,
    )


MOST_TURNED = 32
"""The most candidates of a waypoint that differ from its solutions by given whole turns; the nearest are kept."""

TURNS = np.array([0.0, -TURN, TURN])
"""Turns of one joint from its position nearest to the joint position before, rad."""


@dataclass(frozen=True, eq=False)
class Layer:
    """The candidates of one waypoint.

    Attributes:
        positions: (candidates, joints), rad or m.
        fewest: (candidates, joints): fewest whole turns of each joint towards the joint position before that keep it
            within its limits. Infinite for a joint without limits; 0: no turn.
        most: (candidates, joints), likewise.
        conditioning: (candidates,), in [0, 1]: manipulability as a share of the largest of the waypoint's solutions.
        wanted: The configuration of all candidates.
        descend: For a continuum of solutions: function from a joint position (joints,) to a solution nearby and its
            conditioning, or to None.
        is_given: Whether the waypoint is a joint position.
        solutions: The number of solutions found, which are the first candidates, each once; 0: not counted.
        pins: (joints,), rad or m: fixed positions of external axes; NaN for all other joints; None: no axis is fixed.
    """

    positions: FloatArray
    fewest: FloatArray
    most: FloatArray
    conditioning: FloatArray
    wanted: Configuration = Configuration()
    descend: Callable[[FloatArray], tuple[FloatArray, float] | None] | None = None
    is_given: bool = False
    solutions: int = 1
    pins: FloatArray | None = None

    @classmethod
    def given(cls, position: FloatArray, may_turn: np.ndarray) -> Layer:
        """Return the layer of a joint waypoint, whose only choice is whole turns.

        Args:
            position: (joints,).
            may_turn: (joints,), bool: the joints that go to the turn nearest to where they come from.
        """
        turns = np.where(may_turn, np.inf, 0.0)[None]
        return cls(position[None], -turns, turns, np.ones(1), is_given=True)

    @classmethod
    def settled(cls, position: FloatArray) -> Layer:
        """Return the layer of a pose that was chosen for one joint position (joints,)."""
        still = np.zeros_like(position)[None]
        return cls(position[None], still, still, np.ones(1), solutions=0)

    @classmethod
    def isolated(cls, robot: Robot, solutions: Sequence[FloatArray], ahead: FloatArray) -> Layer:
        """Return the layer of a pose with isolated solutions.

        The layer has every solution twice: free to turn towards the joint position before, and fixed nearest to
        `ahead`. The second form has whole turns of joints with finite limits.

        Args:
            robot: The arm.
            solutions: All solutions, (joints,) each, without whole turns.
            ahead: (joints,): the next joint position, if known.
        """
        branches = np.array(solutions)
        measure = manipulability(robot, branches)
        conditioning = measure / max(float(measure.max()), LEAST_MANIPULABILITY)
        fewest, most = _turns_within(robot, branches)
        layer = cls(branches, fewest, most, conditioning, solutions=len(branches))
        if not (most > fewest).any():
            return layer
        turned, branch = _turned(robot, branches, ahead, fewest, most)
        return layer._and(turned, np.zeros((2, *turned.shape)), conditioning[branch])

    @classmethod
    def continuum(
        cls,
        robot: Robot,
        solutions: Sequence[FloatArray],
        ahead: FloatArray,
        pose: Pose,
        options: InverseKinematicsOptions,
        wanted: Configuration = Configuration(),
    ) -> Layer:
        """Return the layer of a pose with a continuum of solutions, of which `solutions` are a spread."""
        layer = replace(cls.isolated(robot, solutions, ahead), wanted=wanted)
        best = max(float(manipulability(robot, np.array(solutions)).max()), LEAST_MANIPULABILITY)
        lower, upper = robot.limit("lower"), robot.limit("upper")
        search = Search(robot, pose, options)

        def descend(start: FloatArray) -> tuple[FloatArray, float] | None:
            start = np.clip(start, lower, upper)
            q = with_still_axes(search, start, wanted) if options.prefer == "arm" and robot.external_axes else None
            q = search.solve(start, QUICK) if q is None else q
            if q is None or not in_configuration(robot, [q], wanted):
                return None
            return q, min(float(manipulability(robot, q[None])[0]) / best, 1.0)

        return replace(layer, descend=descend).with_descents([ahead])

    def on_pins(self, pinned: Pinned) -> Layer:
        """Extend candidates by the fixed external axes, which make no whole turns."""
        if not pinned.is_pinned:
            return self
        turns = np.zeros((2, len(self.positions), len(pinned.values)))
        turns[:, :, pinned.left] = self.fewest, self.most
        descend = self.descend

        def descend_all(start: FloatArray) -> tuple[FloatArray, float] | None:
            found = None if descend is None else descend(pinned.own(start))
            return None if found is None else (pinned.whole(found[0]), found[1])

        return replace(
            self,
            positions=pinned.whole(self.positions),
            fewest=turns[0],
            most=turns[1],
            descend=None if descend is None else descend_all,
            pins=np.where(pinned.left, np.nan, pinned.values),
        )

    def where_free(self, is_free: IsFree) -> Layer:
        """Return the collision-free candidates, or all candidates if none is collision-free."""
        free = is_free(self.positions)
        if not free.any():
            return self
        descend = self.descend

        def descend_free(start: FloatArray) -> tuple[FloatArray, float] | None:
            found = None if descend is None else descend(start)
            return found if found is not None and is_free(found[0][None])[0] else None

        return replace(
            self,
            positions=self.positions[free],
            fewest=self.fewest[free],
            most=self.most[free],
            conditioning=self.conditioning[free],
            descend=None if descend is None else descend_free,
            solutions=int(free[: self.solutions].sum()),
        )

    @property
    def pinned_ends(self) -> FloatArray | None:
        """Solutions (n, joints) where a motion of the tool may end, if external axes are pinned there; None: any."""
        return None if self.pins is None else self.positions

    def with_descents(self, starts: Sequence[FloatArray] | FloatArray) -> Layer:
        """Return the layer with the solutions of a continuum near some joint positions (joints,), if there is one."""
        if self.descend is None:
            return self
        found = [near for near in map(self.descend, starts) if near is not None]
        if not found:
            return self
        positions, conditioning = (np.array(values) for values in zip(*found, strict=True))
        return self._and(positions, np.zeros((2, *positions.shape)), conditioning)

    def with_solutions(self, robot: Robot, solutions: Sequence[FloatArray]) -> Layer:
        """Return the layer with further solutions (joints,) of a continuum, each both fixed and free to turn.

        Solutions in another configuration than the requested one are left out, and solutions that move a fixed axis.
        """
        solutions = [q for q in in_configuration(robot, solutions, self.wanted) if self._is_pinned(q)]
        if not solutions:
            return self
        positions = np.array([*solutions, *solutions])
        turns = np.array(_turns_within(robot, positions))
        turns[:, : len(solutions)] = 0.0
        return self._and(positions, turns, np.ones(len(positions)))

    def _and(self, positions: FloatArray, turns: FloatArray, conditioning: FloatArray) -> Layer:
        """Return the layer with more candidates (n, joints), their fewest and most turns (2, n, joints) and (n,)."""
        return replace(
            self,
            positions=np.vstack([self.positions, positions]),
            fewest=np.vstack([self.fewest, turns[0]]),
            most=np.vstack([self.most, turns[1]]),
            conditioning=np.concatenate([self.conditioning, conditioning]),
        )

    def _is_pinned(self, position: FloatArray) -> bool:
        """Tell whether a joint position (joints,) has all fixed external axes at their positions."""
        return self.pins is None or not bool((np.abs(position - self.pins) > POSITION_TOLERANCE).any())

    def reached_from(self, origins: FloatArray) -> FloatArray:
        """Turn every candidate towards every origin (origins, joints): (origins, candidates, joints)."""
        turns = np.round((origins[:, None] - self.positions) / TURN)
        return self.positions + TURN * np.minimum(np.maximum(turns, self.fewest), self.most)


def _turns_within(robot: Robot, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Give the fewest and the most whole turns (n, joints) that keep each angle within its limits, none among them."""
    fewest, most = turns_within(robot, positions)
    return np.minimum(fewest, 0.0), np.maximum(most, 0.0)


def _turned(
    robot: Robot, branches: FloatArray, towards: FloatArray, fewest: FloatArray, most: FloatArray
) -> tuple[FloatArray, np.ndarray]:
    """Return branches nearest to `towards`, variants a turn away within finite limits, and their branch indices."""
    lower, upper = robot.limit("lower"), robot.limit("upper")
    turned = branches + TURN * np.clip(np.round((towards - branches) / TURN), fewest, most)
    may_turn = robot.is_angle & np.isfinite(upper - lower) & (upper - lower >= TURN)
    branch, distance = np.arange(len(branches)), np.zeros(len(branches))
    # One joint after the other: the turns that keep it within its limits, and how far the joints are at most.
    for joint, turns in enumerate(may_turn.tolist()):
        choices = turned[:, joint, None] + (TURNS if turns else TURNS[:1])
        inside = np.minimum(np.maximum(choices, lower[joint]), upper[joint])
        rows, picked = np.nonzero(np.abs(choices - inside) <= TURN * ROUNDING)
        turned, branch = turned[rows], branch[rows]
        turned[:, joint] = inside[rows, picked]
        distance = np.maximum(distance[rows], np.abs(turned[:, joint] - towards[joint]))
    kept = distance.argsort(kind="stable")[:MOST_TURNED]
    return turned[kept], branch[kept]
