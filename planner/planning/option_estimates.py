"""Estimated durations of a problem with goal sets, for every option: the shortest path through a layered graph.

The layers are the waypoints, the nodes are the joint positions of all options at them. All options of a goal set are
timed at once. The estimates decide the order in which options are planned.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from time import monotonic
from typing import NamedTuple

import numpy as np

from planner.planning.option_layers import Layer, OptionLayers
from planner.problems.any_of import AnyOf
from planner.problems.problem import PlanningProblem
from planner.scene import checker_at_waypoints, is_free
from planner.scene.scene import Handling
from planner.spatial import FloatArray

NONE = -1
"""The number of the node in a layer through which a path does not lead."""

TIMED_TOGETHER = 2**18
"""The number of joint travels timed at once: their arrays stay in the cache of a processor."""

MOST_CHECKED = 8
"""The most options whose shortest paths are checked for collisions at once: as long as one search takes."""


class _Paths(NamedTuple):
    """The shortest paths so far, in groups that are kept apart, to the joint positions of each option.

    Attributes:
        times: (groups, options, candidates), s.
        positions: (groups, options, candidates, joints): where they end.
        nodes: (groups, options, candidates, layers): their node in each layer of the problem.
    """

    times: FloatArray
    positions: FloatArray
    nodes: np.ndarray

    @classmethod
    def beginning(cls, layer: Layer, layers: int) -> _Paths:
        """Return paths of no time to each node of the first layer."""
        times = np.where(layer.is_usable, 0.0, np.inf)[None]
        return cls(times, layer.positions[None], np.full((*times.shape, layers), NONE))

    def through(self, layer: Layer, closed: np.ndarray | None, until: float) -> _Paths:
        """Extend each path to the same option of the next layer; from one option alone, to all.

        Args:
            layer: The next layer.
            closed: (groups, origins, options), bool: steps that are ruled out; None: none.
            until: The time on the monotonic clock, s, from which no path leads to further options, if one leads on.
        """
        (groups, own, origins), (count, candidates, joints) = self.times.shape, layer.positions.shape
        together = max(1, TIMED_TOGETHER // (groups * origins * candidates * joints))
        parts: list[_Paths] = []
        for begin in range(0, count, together):
            some = np.arange(begin, min(begin + together, count))
            if monotonic() > until and any(np.isfinite(part.times).any() for part in parts):
                parts.append(self._unreached(layer.of(np.arange(begin, count))))
                break
            paths = self if own == 1 else _Paths(*(values[:, some] for values in self))
            parts.append(paths._to(layer.of(some), None if closed is None else closed[..., some]))
        return _Paths(*(np.concatenate(values, axis=1) for values in zip(*parts, strict=True)))

    def _unreached(self, layer: Layer) -> _Paths:
        """Return paths that take forever to each node of a layer."""
        shape = (len(self.times), *layer.exists.shape)
        positions = np.broadcast_to(layer.positions, (*shape, layer.positions.shape[-1]))
        return _Paths(np.full(shape, np.inf), positions, np.full((*shape, self.nodes.shape[-1]), NONE))

    def _to(self, layer: Layer, closed: np.ndarray | None) -> _Paths:
        """Extend each path, see `through`, to all options of the layer at once."""
        times, positions, nodes = (np.moveaxis(values, 2, 1) for values in self)
        between, ends = layer.times_from(positions)
        is_open = np.broadcast_to(layer.is_usable, between.shape)
        if layer.follows.any():  # a tool motion leads from one joint position to one other
            nearest = np.where(layer.exists, between, np.inf).argmin(axis=-1)[..., None]
            is_open = is_open & ((np.arange(between.shape[-1]) == nearest) | ~layer.follows[:, None])
        if closed is not None:
            is_open = is_open & ~closed[..., None]
        every = np.where(is_open, times[..., None] + between, np.inf)
        times, origin = every.min(axis=1), every.argmin(axis=1)
        groups, options, candidates = np.ogrid[tuple(map(slice, times.shape))]
        nodes = np.broadcast_to(nodes, (*every.shape[:3], nodes.shape[-1]))
        return _Paths(times, ends[groups, origin, options, candidates], nodes[groups, origin, options])

    def of_one_option(self) -> _Paths:
        """Return the paths as if all their ends were candidates of one option."""
        groups = len(self.times)
        return _Paths(*(values.reshape(groups, 1, -1, *values.shape[3:]) for values in self))

    def apart(self) -> _Paths:
        """Return the paths with a group for each option."""
        return _Paths(*(np.moveaxis(values, 1, 0) for values in self))

    def shortest(self) -> tuple[FloatArray, np.ndarray]:
        """Return the times (groups,), s, and the nodes (groups, layers) of the shortest path of each group."""
        groups = np.arange(len(self.times))
        times = self.times.reshape(len(groups), -1)
        row = times.argmin(axis=1)
        return times[groups, row], self.nodes.reshape(*times.shape, -1)[groups, row]


class OptionEstimates:
    """Estimates of all options of the goal sets of a problem, and the options that are ruled out.

    Attributes:
        goal_sets: Indices of the goal sets.
    """

    def __init__(self, problem: PlanningProblem, until: float = inf) -> None:
        """Solve the poses of all options.

        Args:
            problem: The problem.
            until: The time on the monotonic clock, s, from which no further option is solved or timed. The first
                option of each waypoint is always solved, and the first that can be reached always timed.
        """
        self._solved, self._until = OptionLayers(problem, until), until
        self.goal_sets = [k for k in self._solved.first if isinstance(problem.waypoints[k], AnyOf)]
        self._layers = [(k, step) for k in self._solved.first for step in range(len(self._solved.layers[k]))]
        self._refused = {k: np.zeros(len(self._solved.nodes[k]), dtype=bool) for k in self.goal_sets}
        self._pairs: dict[int, np.ndarray] = {}
        self._found: dict[tuple[int | None, tuple[tuple[int, int], ...]], tuple[FloatArray, np.ndarray]] = {}
        every = [node.waypoint for options in self._solved.nodes.values() for option in options for node in option]
        handling = [Handling(waypoint.attach, waypoint.detach) for waypoint in every]
        self._checker = checker_at_waypoints(problem.robot, problem.scene, problem.self_collision, handling)

    def best(self) -> dict[int, int] | None:
        """Return the options with the shortest estimate that are not ruled out; None: there are none.

        Collisions are checked only at joint positions that might be on the shortest path.
        """
        count = 1
        while True:
            times, nodes = self._shortest(self.goal_sets[0] if len(self.goal_sets) == 1 else None, {})
            row = int(times.argmin())
            if not np.isfinite(times[row]):
                return None
            best = {k: self._option(k, nodes[row]) for k in self.goal_sets}
            if self._is_checked(nodes[row]):
                return best
            suspects = [nodes[row]]
            for k in self.goal_sets:
                times, nodes = self._shortest(k, {j: option for j, option in best.items() if j != k})
                order = np.argsort(times, kind="stable")[:count]
                suspects += list(nodes[order[np.isfinite(times[order])]])
            self._check(np.array(suspects))
            count = min(2 * count, MOST_CHECKED)

    def refuse(self, options: Mapping[int, int], waypoints: Sequence[int]) -> list[int]:
        """Exclude chosen options because of a refusal; return the indices of their goal sets.

        Args:
            options: The chosen options.
            waypoints: Indices in the request of the waypoints at fault, ascending. If none is a goal set or relative
                to one, the last goal set before them is at fault, or the first of all.
        """
        before = [max((k for k in self._solved.first if k <= waypoint), default=0) for waypoint in waypoints]
        blamed = [k for k in dict.fromkeys(before) if k in options]
        if len(blamed) > 1:
            one, other = blamed
            pairs = self._pairs.setdefault(other, np.zeros([len(self._solved.nodes[k]) for k in blamed], dtype=bool))
            pairs[options[one], options[other]] = True
            self._found.clear()
            return blamed
        last = max((k for k in self.goal_sets if k <= min(waypoints, default=0)), default=self.goal_sets[0])
        self._found.clear()
        (k,) = blamed or [last]
        self._refused[k][options[k]] = True
        return [k]

    def estimates(self, goal_set: int, options: Mapping[int, int]) -> FloatArray:
        """Return the estimated durations (options,), s, of the options of a goal set, with given others elsewhere.

        They are infinite for options that are ruled out, or not timed so far.
        """
        return self._shortest(goal_set, {k: option for k, option in options.items() if k != goal_set})[0]

    @property
    def are_all_solved(self) -> bool:
        """Whether the poses of all options were solved in time."""
        return all(self._solved.is_solved[k].all() for k in self.goal_sets)

    def is_unreachable(self, goal_set: int, option: int) -> bool:
        """Tell whether a waypoint of an option has no solution; not so if the time ended before."""
        if not self._solved.is_solved[goal_set][option]:
            return False
        return any(not layer.exists[option].any() for layer in self._solved.layers[goal_set])

    def is_colliding(self, goal_set: int, option: int) -> bool:
        """Tell whether all solutions of a waypoint of an option are known to collide."""
        if not self._solved.is_solved[goal_set][option]:
            return False
        return any(not layer.is_usable[option].any() for layer in self._solved.layers[goal_set])

    def _option(self, k: int, nodes: np.ndarray) -> int:
        """Return the option of a goal set on a path with nodes (layers,)."""
        return int(nodes[self._layers.index((k, 0))] // self._solved.layers[k][0].exists.shape[1])

    def _shortest(self, apart: int | None, options: Mapping[int, int]) -> tuple[FloatArray, np.ndarray]:
        """Return times and nodes of the shortest paths, see `_paths`, from the cache if possible."""
        key = apart, tuple(options.items())
        if key not in self._found:
            self._found[key] = self._paths(apart, options).shortest()
        return self._found[key]

    def _paths(self, apart: int | None, options: Mapping[int, int]) -> _Paths:
        """Find the shortest paths to the end.

        Args:
            apart: Goal set whose options are kept apart; None: none.
            options: Options of the other goal sets; without an entry any.
        """
        paths: _Paths | None = None
        for k in self._solved.first:
            layers = self._solved.layers[k]
            if k not in self.goal_sets and not all(layer.is_usable.any() for layer in layers):
                continue  # the plan itself says why
            which = np.array([options[k]]) if k in options else np.arange(len(layers[0].exists))
            closed = None
            if paths is not None and k in self._pairs:
                before = self.goal_sets[self.goal_sets.index(k) - 1]
                taken = paths.nodes[:, 0, :, self._layers.index((before, 0))]
                closed = self._pairs[k][taken // self._solved.layers[before][0].exists.shape[1]][:, :, which]
            for step, layer in enumerate(layers):
                of_these = layer if len(which) == len(layer.exists) else layer.of(which)
                if paths is None:
                    paths = _Paths.beginning(of_these, len(self._layers))
                else:
                    paths = paths.through(of_these, closed if step == 0 else None, self._until)
                width = layer.exists.shape[1]
                paths.nodes[..., self._layers.index((k, step))] = which[:, None] * width + np.arange(width)
            assert paths is not None  # noqa: S101 - each waypoint has a layer
            if k in self.goal_sets:
                paths.times[:, self._refused[k][which]] = np.inf
            paths = paths.apart() if k == apart else paths.of_one_option()
        assert paths is not None  # noqa: S101 - a goal set is among the waypoints
        return paths

    def _is_checked(self, nodes: np.ndarray) -> bool:
        """Tell whether the nodes (layers,) of a path have been checked for collisions."""
        if self._checker is None or self._checker.is_empty:
            return True
        layers = [self._solved.layers[k][step] for k, step in self._layers]
        return all(layer.is_checked.flat[node] for layer, node in zip(layers, nodes, strict=True) if node != NONE)

    def _check(self, nodes: np.ndarray) -> None:
        """Exclude nodes (paths, layers) that collide."""
        assert self._checker is not None  # noqa: S101 - else all are taken as checked
        self._found.clear()
        for (k, step), column in zip(self._layers, nodes.T, strict=True):
            layer = self._solved.layers[k][step]
            rows = np.unique(column[column != NONE])
            rows = rows[~layer.is_checked.flat[rows]]
            if not len(rows):
                continue
            free = is_free(self._checker, layer.positions.reshape(-1, layer.positions.shape[-1])[rows])
            layer.is_checked.flat[rows] = True
            layer.is_usable.flat[rows] = free
            for option in np.unique(rows // layer.exists.shape[1]).tolist():
                if not layer.is_usable[option].any() and not self._solved.is_known_wholly(k, option, step):
                    layer.is_usable[option], layer.is_checked[option] = layer.exists[option], True
