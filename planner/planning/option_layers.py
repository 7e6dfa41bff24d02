"""The joint positions of all options of a problem with goal sets, in layers: one for each waypoint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf
from time import monotonic
from typing import NamedTuple

import numpy as np

from planner.kinematics.configurations import in_configuration
from planner.kinematics.inverse import solution_layers
from planner.kinematics.search import is_isolated
from planner.kinematics.turns import TURN, counted_velocity, turns_within
from planner.limits import Limits, segment_limits
from planner.problems.any_of import AnyOf, Expansion, waypoints_of
from planner.problems.problem import (
    AnyWaypoint,
    CartesianMotion,
    JointWaypoint,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
)
from planner.problems.regions import region_of
from planner.robots import Robot
from planner.spatial import FloatArray, Pose
from planner.waypoints.goal_regions import positions_in_region
from planner.waypoints.pinned import Pinned, pinned_robots
from planner.waypoints.targets import wanted_poses

MOST_CANDIDATES = 16
"""The most joint positions of one waypoint of an option that are estimated."""

SOLVED_TOGETHER = 64
"""The number of poses solved at once: many are faster, but the time is only looked at between them."""


class Node(NamedTuple):
    """One waypoint of one option.

    Attributes:
        waypoint: The waypoint, without its tolerance region.
        requested: The waypoint as in the request.
        pinned: The robot that reaches it.
        pose: Its pose; None: not known without the joint position before.
    """

    waypoint: AnyWaypoint
    requested: AnyWaypoint
    pinned: Pinned
    pose: Pose | None


@dataclass(eq=False)
class Layer:
    """The same waypoint of all options of a requested one; shorter options repeat their last waypoint.

    Attributes:
        positions: (options, candidates, joints), rad or m; of missing candidates any.
        exists: (options, candidates), bool: whether there is such a candidate.
        is_usable: Likewise: whether it is not known to collide, either.
        is_checked: Likewise: whether it was checked for collisions.
        fewest: (options, candidates, joints): fewest whole turns within the limits.
        most: Likewise.
        velocity: (options, joints), the limits of the motion to here.
        acceleration: (options, joints).
        follows: (options,), bool: whether a tool motion leads here.
        least: (options,), s: the least time of the motion to here.
        fixed: (options,), s: its requested time; NaN: none.
        dwell: (options,), s.
    """

    positions: FloatArray
    exists: np.ndarray
    is_usable: np.ndarray
    is_checked: np.ndarray
    fewest: FloatArray
    most: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    follows: np.ndarray
    least: FloatArray
    fixed: FloatArray
    dwell: FloatArray

    def of(self, options: np.ndarray) -> Layer:
        """Return the layer of some options, by index."""
        return Layer(*(values[options] for values in vars(self).values()))

    def times_from(self, origins: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return times (..., origins, options, candidates), s, from joint positions, and where the joints get to.

        Args:
            origins: (..., origins, options or 1, joints).
        """
        start = origins[..., None, :]
        reached = np.broadcast_to(self.positions, (*start.shape[:-3], *self.positions.shape))
        if (self.most > self.fewest).any():
            turns = np.round((start - self.positions) / TURN)
            reached = self.positions + TURN * np.minimum(np.maximum(turns, self.fewest), self.most)
        travels = np.abs(reached - start)
        speed = (travels / self.velocity[:, None]).max(axis=-1)
        ramp = (travels / self.acceleration[:, None]).max(axis=-1)
        # One trapezoid of the velocity moves all joints along the straight segment.
        with np.errstate(invalid="ignore", divide="ignore"):
            times = np.where(ramp > speed**2, 2.0 * np.sqrt(ramp), speed + np.where(speed > 0.0, ramp / speed, 0.0))
        times = np.maximum(times, self.least[:, None])
        return np.where(np.isnan(self.fixed)[:, None], times, self.fixed[:, None]) + self.dwell[:, None], reached


class OptionLayers:
    """The layers of all waypoints of a problem; relative waypoints belong to the options before them.

    Attributes:
        first: Indices of the waypoints that are not relative.
        nodes: The waypoints of each option of each of these, and of the relative waypoints after it.
        candidates: The joint positions (candidates, joints) at each node, rad or m.
        is_solved: (options,), bool: whether all poses of an option were solved in time.
        layers: The layers.
    """

    def __init__(self, problem: PlanningProblem, until: float = inf) -> None:
        """Solve the poses of all options.

        Args:
            problem: The problem.
            until: The time on the monotonic clock, s, from which no option but the first ones is solved.
        """
        self._problem = problem
        self._expansion = Expansion.of(problem, {})
        waypoints = problem.waypoints
        self.first = [k for k, waypoint in enumerate(waypoints) if not isinstance(waypoint, RelativeWaypoint)]
        self.nodes = self._nodes()
        self.candidates = self._candidates(until)
        self.layers = {k: self._layers_of(self.nodes[k], self.candidates[k]) for k in self.first}

    def _nodes(self) -> dict[int, list[list[Node]]]:
        """Return the waypoints of each option of each requested waypoint, and the relative waypoints after it."""
        problem, first = self._expansion.problem, self._expansion.first
        robots: list[Robot] = []
        every: list[AnyWaypoint] = []
        sizes = {}
        for k, after in pairwise([*self.first, len(first) - 1]):
            waypoint = self._problem.waypoints[k]
            tail = slice(first[k + 1], first[after])
            options = [waypoints_of(one) for one in (waypoint.options if isinstance(waypoint, AnyOf) else (waypoint,))]
            sizes[k] = [len(option) + tail.stop - tail.start for option in options]
            for option in options:
                robots += [*[problem.robots[first[k]]] * len(option), *problem.robots[tail]]
                every += [*option, *problem.waypoints[tail]]
        exact = list(map(_without_region, every))
        pinned = pinned_robots(robots, exact)
        found: dict[int, list[list[Node]]] = {}
        begin = 0
        for k, lengths in sizes.items():
            found[k] = []
            for length in lengths:
                part = slice(begin, begin + length)
                poses = wanted_poses(robots[part], exact[part])
                found[k].append([Node(*one) for one in zip(exact[part], every[part], pinned[part], poses, strict=True)])
                begin += length
        return found

    def _candidates(self, until: float) -> dict[int, list[list[FloatArray]]]:
        """Return the joint positions (candidates, joints) of all waypoints of all options."""
        every = [
            (k, option, step)
            for k in self.first
            for option, nodes in enumerate(self.nodes[k])
            for step in range(len(nodes))
        ]
        every.sort(key=lambda at: at[1])  # the first option of each goal set, then the second of each
        nowhere = np.zeros((0, self._problem.robot.dof))
        found = {k: [[nowhere for _ in option] for option in self.nodes[k]] for k in self.first}
        self.is_solved = {k: np.zeros(len(self.nodes[k]), dtype=bool) for k in self.first}
        for begin in range(0, len(every), SOLVED_TOGETHER):
            some = every[begin : begin + SOLVED_TOGETHER]
            solved = self._solutions([self.nodes[k][option][step] for k, option, step in some])
            for row, (k, option, step) in enumerate(some):
                if option and monotonic() > until:
                    return found
                node = self.nodes[k][option][step]
                found[k][option][step] = self._positions(node, solved.get(row, ()))
                self.is_solved[k][option] = step == len(self.nodes[k][option]) - 1
        return found

    def _solutions(self, nodes: Sequence[Node]) -> dict[int, Sequence[FloatArray]]:
        """Return the solutions (joints,) at the poses of nodes, by the indices of these."""
        solved: dict[int, Sequence[FloatArray]] = {}
        for pinned in dict.fromkeys(node.pinned for node in nodes):
            rows = [
                row
                for row, node in enumerate(nodes)
                if node.pinned is pinned and node.pose is not None and not isinstance(node.waypoint, JointWaypoint)
            ]
            poses = [pose for row in rows if (pose := nodes[row].pose) is not None]
            options, near = pinned.options(self._problem.inverse_kinematics), pinned.own(self._near)
            solved |= dict(zip(rows, solution_layers(pinned.robot, poses, options, near), strict=True))
        return solved

    @property
    def _near(self) -> FloatArray:
        reference = self._problem.inverse_kinematics.reference
        return self._problem.robot.middle if reference is None else np.array(reference)

    def _positions(self, node: Node, solutions: Sequence[FloatArray]) -> FloatArray:
        """Return the joint positions (candidates, joints) of one waypoint."""
        if isinstance(node.waypoint, JointWaypoint):
            return np.array([node.waypoint.position])
        if isinstance(node.waypoint, PoseWaypoint) and node.waypoint.configuration.names:
            solutions = in_configuration(node.pinned.robot, solutions, node.waypoint.configuration)
        if solutions:
            return node.pinned.whole(np.array(solutions[:MOST_CANDIDATES]))
        if isinstance(node.requested, PoseWaypoint) and node.requested.free:
            options = self._problem.inverse_kinematics
            found = positions_in_region(node.pinned, node.requested, self._near, options)
            return (
                found[np.unique(np.linspace(0, len(found) - 1, MOST_CANDIDATES).astype(int))] if len(found) else found
            )
        return np.zeros((0, self._problem.robot.dof))

    def _layers_of(self, options: list[list[Node]], candidates: list[list[FloatArray]]) -> list[Layer]:
        """Return the layers of a requested waypoint; shorter options stay at their last waypoint."""
        joints, count = self._problem.robot.dof, len(options)
        most = max(1, *(len(found) for option in candidates for found in option))
        mass = 0.0 if self._problem.payload is None else self._problem.payload.largest_mass
        layers = []
        for step in range(max(map(len, options))):
            rows = [min(step, len(option) - 1) for option in options]
            nodes = [option[row] for option, row in zip(options, rows, strict=True)]
            limits = segment_limits(
                self._problem.robot, self._problem.limits, tuple(node.waypoint.limits for node in nodes), [mass] * count
            )
            positions, exists = np.zeros((count, most, joints)), np.zeros((count, most), dtype=bool)
            for i, row in enumerate(rows):
                found = candidates[i][row]
                positions[i, : len(found)], exists[i, : len(found)] = found, True
            fewest, turns = self._turns(nodes, positions)
            moves = np.array([row == step for row in rows])
            least = [self._least_time(option, step) for option in options]
            fixed = [node.waypoint.duration for node in nodes]
            dwell = np.array([node.waypoint.dwell for node in nodes])
            layers.append(
                Layer(
                    positions,
                    exists,
                    exists.copy(),
                    np.zeros_like(exists),
                    fewest,
                    turns,
                    counted_velocity(limits.velocity.narrower),
                    limits.acceleration.narrower,
                    moves & [isinstance(node.waypoint.motion, CartesianMotion) for node in nodes],
                    np.where(moves, least, 0.0),
                    np.where(moves, np.array(fixed, dtype=float), np.nan),
                    np.where(moves, dwell, 0.0),
                )
            )
        return layers

    def _turns(self, nodes: Sequence[Node], positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the fewest and the most whole turns (options, candidates, joints) of joint positions."""
        robot = self._problem.robot
        is_given = np.array([isinstance(node.waypoint, JointWaypoint) for node in nodes])[:, None, None]
        fewest, most = turns_within(robot, positions)
        of_given = np.where(robot.is_continuous, np.inf, 0.0)
        fewest, most = np.minimum(fewest, 0.0), np.maximum(most, 0.0)
        return np.where(is_given, -of_given, fewest), np.where(is_given, of_given, most)

    def _least_time(self, option: Sequence[Node], step: int) -> float:
        """Return the least time, s, of the motion to a waypoint by the limits of the tool."""
        if step >= len(option):
            return 0.0
        waypoint, least = option[step].waypoint, option[step].waypoint.minimum_duration
        before, pose = option[step - 1].pose if step else None, option[step].pose
        if before is None or pose is None or not isinstance(waypoint.motion, CartesianMotion):
            return least
        limits = [limits for limits in (waypoint.limits, self._problem.limits) if isinstance(limits, Limits)]
        speeds = [limits.tcp_linear_velocity for limits in limits if limits.tcp_linear_velocity]
        distance = float(np.linalg.norm(pose.position - before.position))
        return max(least, distance / min(speeds, default=np.inf))

    def is_known_wholly(self, k: int, option: int, step: int) -> bool:
        """Tell whether a waypoint of an option has no other joint positions than its candidates."""
        nodes, candidates = self.nodes[k][option], self.candidates[k][option]
        node, found = nodes[min(step, len(nodes) - 1)], candidates[min(step, len(nodes) - 1)]
        if isinstance(node.waypoint, JointWaypoint):
            return True
        if node.pose is None or (isinstance(node.requested, PoseWaypoint) and node.requested.free):
            return False
        return is_isolated(node.pinned.robot, node.pose, node.pinned.own(found[0]))


def _without_region(waypoint: AnyWaypoint) -> AnyWaypoint:
    """Return a waypoint at the pose of its tolerance region that is nearest to the written one."""
    if not isinstance(waypoint, PoseWaypoint) or not waypoint.free:
        return waypoint
    region = region_of(waypoint.free)
    offsets = np.array([np.clip(0.0, *ends) for ends in region.ranges.values()])
    return replace(waypoint, pose=region.pose(waypoint.pose, offsets), free=None)
