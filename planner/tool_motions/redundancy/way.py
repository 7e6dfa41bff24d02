"""The cheapest values of open coordinates along a path: by a layered graph, from coarse values to fine ones."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.kernels.layers import Layers, StepCosts, cheapest_way
from planner.kinematics.costs import EXTERNAL_PENALTY, PREFERENCE_WEIGHT, tilts
from planner.kinematics.options import Preference
from planner.kinematics.turns import TURN, counted_velocity
from planner.spatial import FloatArray
from planner.tool_motions.pose_paths import PosePath
from planner.tool_motions.redundancy.coordinates import OpenCoordinates
from planner.tool_motions.redundancy.offset_paths import poses_at
from planner.tool_motions.redundancy.smoothing import room_off_limits
from planner.tool_motions.redundancy.tracking import tracked_states

FEWEST_NODES = 13
"""The fewest poses of a path at which the coordinates are chosen."""

NODES_OF_CURVE = 49
"""The most such poses of a path of few pieces; of a path of more pieces, there are as many as these."""

NODE_TRAVEL = 0.02, 0.05
"""The travel of the tool from such a pose to the next, m and rad, if there are more than the fewest."""

MOST_POSES = 160_000
"""The most poses times values of the coordinates: 2,000 poses with 72 turns take 2 to 3 s."""

SWEEP = TURN / 72
"""The distance of the first values of an angle, rad."""

SLIDE_SWEEP = 0.1
"""The distance of the first values of an external axis that slides, m."""

FEWEST_VALUES = 9
"""The fewest first values of a coordinate."""

MOST_VALUES = 729
"""The most first values of all coordinates together."""

MOST_COORDINATES = 6
"""The most coordinates that are chosen: of more, three values each would be too many."""

NEARBY_VALUES = {1: 9, 2: 9, 3: 5, 4: 5}
"""Number of finer values of each coordinate, by the number of coordinates; of more coordinates, three."""

FINE_DISTANCE = 0.005
"""The largest distance of values, rad or m, that needs no finer ones."""

MOST_REFINEMENTS = 8
"""The most times that finer values are chosen from."""

LONGEST_ARM_STEP = 1.0
"""The longest step of a joint of the arm from pose to pose, rad or m; beyond may be another branch."""


class Way(NamedTuple):
    """The cheapest way, at even parameters from 0 to 1.

    Attributes:
        values: (nodes, coordinates), rad or m.
        positions: (nodes, joints), rad or m, which reach the poses at these values.
        cost: The cost of the way, s^2.
    """

    values: FloatArray
    positions: FloatArray
    cost: float


class _Choices(NamedTuple):
    """The values that are chosen from: their nodes (N,), and (N, coordinates)."""

    nodes: np.ndarray
    values: FloatArray


def cheapest_values(
    coordinates: OpenCoordinates, path: PosePath, start: FloatArray, ends: list[FloatArray], prefer: Preference
) -> Way | None:
    """Return the cheapest values along a path; None: no way leads along it in one configuration.

    The cost of a way is the integral over u from 0 to 1 of sum_j (dq_j/du / v_j)^2, with velocity limits v_j. So
    joints move evenly and little. With `prefer` = `arm`, external axes count `EXTERNAL_PENALTY` times as fast. With
    `weld_flat`, `PREFERENCE_WEIGHT` times the mean tilt of the workpiece is added. The first values are spread over the
    ranges of the coordinates; then come finer and finer ones around the best.

    Args:
        coordinates: The open ones. The arm that is left has six joints or more.
        path: The path of the tool as it is written, with rotations.
        start: (joints,), rad or m, where the path starts: with offsets of 0.
        ends: Joint positions (joints,), at one of which it ends; none: anywhere with offsets of 0.
        prefer: The preference.
    """
    first, spacing = first_values(coordinates)
    nodes = min(_wanted_nodes(path), max(NODES_OF_CURVE, MOST_POSES // len(first)))
    graph = _Graph(coordinates, path, start, ends, prefer, nodes)
    choices = _Choices(np.repeat(np.arange(1, nodes), len(first)), np.tile(first, (nodes - 1, 1)))
    way = graph.cheapest(choices)
    around, shrink = nearby_shares(len(spacing))
    for _ in range(MOST_REFINEMENTS):
        if way is None or spacing.max() <= FINE_DISTANCE:
            break
        near = way.values[1:, None] + around * spacing
        near = np.clip(near, coordinates.first, coordinates.last).reshape(-1, len(spacing))
        finer = graph.cheapest(_Choices(np.repeat(np.arange(1, nodes), len(around)), near))
        way, spacing = finer if finer is not None and finer.cost <= way.cost else way, spacing * shrink
    return way


def _wanted_nodes(path: PosePath) -> int:
    """Return the number of poses of a path at which its coordinates are to be chosen."""
    if len(path.breakpoints) >= NODES_OF_CURVE:
        return len(path.breakpoints)
    twists = np.abs([path.twist(u) for u in np.linspace(0.0, 1.0, FEWEST_NODES)])
    travels = np.linalg.norm(twists.reshape(-1, 2, 3), axis=2).max(axis=0) / NODE_TRAVEL
    return max(FEWEST_NODES, len(path.breakpoints), min(int(travels.max()) + 1, NODES_OF_CURVE))


def first_values(coordinates: OpenCoordinates) -> tuple[FloatArray, FloatArray]:
    """Return values (N, coordinates) all over the ranges of coordinates, and their distances (coordinates,)."""
    most = int(MOST_VALUES ** (1.0 / len(coordinates.lower)) + 1e-9)
    every, spacing = [], []
    for low, high, turns, is_round in zip(
        coordinates.first, coordinates.last, coordinates.is_angle, coordinates.is_round, strict=True
    ):
        span = TURN if is_round else high - low
        wanted = int(np.ceil(span / (SWEEP if turns else SLIDE_SWEEP) - 1e-9)) + (not is_round)
        count = min(max(FEWEST_VALUES, wanted), most)
        if is_round:
            values = TURN / count * np.arange(-(count // 2), count - count // 2)
        else:
            values = np.linspace(low, high, count)
        every.append(values)
        spacing.append(values[1] - values[0])
    grid = np.stack(np.meshgrid(*every, indexing="ij"), axis=-1)
    return grid.reshape(-1, len(every)), np.array(spacing)


def nearby_shares(count: int) -> tuple[FloatArray, float]:
    """Return finer values (N, coordinates) in shares of the distance of the values before, and the share of theirs."""
    each = NEARBY_VALUES.get(count, 3)
    grid = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, each)] * count, indexing="ij"), axis=-1)
    return grid.reshape(-1, count), 2.0 / max(4, each - 1)


class _Graph:
    """The poses of a path, from node to node of which the joints go.

    Attributes:
        guide: Joint positions (nodes, joints) near which an arm without a closed form is solved: the best way known.
    """

    def __init__(
        self,
        coordinates: OpenCoordinates,
        path: PosePath,
        start: FloatArray,
        ends: list[FloatArray],
        prefer: Preference,
        nodes: int,
    ) -> None:
        self.coordinates, self.start, self.ends, self.prefer, self.nodes = coordinates, start, ends, prefer, nodes
        u = np.linspace(0.0, 1.0, nodes)
        self.points, self.axes = poses_at(path, u)
        self.room = room_off_limits(u)
        robot, carried = coordinates.robot, coordinates.carried
        is_external = np.arange(robot.dof) < carried
        furthest = np.where(is_external, np.inf, LONGEST_ARM_STEP)
        times = np.where(is_external & (prefer == "arm"), EXTERNAL_PENALTY, 1.0) / counted_velocity(
            robot.limit("velocity")
        )
        near = min(ends, key=lambda end: float(np.abs(end - start).max())) if ends else start
        self.guide = start + u[:, None] * (near - start)
        self.steps = StepCosts((nodes - 1) * times**2, furthest)

    def cheapest(self, choices: _Choices) -> Way | None:
        """Return the cheapest way through values of the nodes behind the first, ascending; None: there is none."""
        carried, start = self.coordinates.carried, self.start
        nodes, values = self._with_ends(choices)
        poses = self.points[nodes], self.axes[nodes]
        if self.coordinates.form is not None:
            states = self.coordinates.states(
                *poses, values, np.broadcast_to(start, (len(nodes), len(start))), self.room[nodes]
            )
        else:
            states = tracked_states(self.coordinates, nodes, *poses, values, self.guide, self.room)
        fewest, most = self.coordinates.turns(states.positions, self.room[nodes[states.rows]])
        inside = (fewest <= most).all(axis=1)
        rows, positions, fewest, most = states.rows[inside], states.positions[inside], fewest[inside], most[inside]
        of_node, values = nodes[rows], values[rows]
        given = np.array([start, *self.ends])
        own = np.hstack([given[:, :carried], np.zeros((len(given), values.shape[1] - carried))])
        still = np.zeros_like(given)
        # The start comes before all states, and given ends come behind them.
        of_node = np.concatenate([[0], of_node, np.full(len(given) - 1, self.nodes - 1)])
        positions, fewest, most, values = (
            np.vstack([ends[:1], inner, ends[1:]])
            for ends, inner in ((given, positions), (still, fewest), (still, most), (own, values))
        )
        layers = Layers(
            np.searchsorted(of_node, np.arange(self.nodes + 1)), positions, fewest, most, self._costs(positions)
        )
        way, reached, cost = cheapest_way(layers, self.steps)
        if not len(way):
            return None
        chosen = values[way].copy()
        chosen[:, :carried] = reached[:, :carried]
        round_offsets = np.flatnonzero(self.coordinates.is_round[carried:]) + carried
        chosen[:, round_offsets] = np.unwrap(chosen[:, round_offsets], axis=0)
        self.guide = reached
        return Way(chosen, reached, cost)

    def _with_ends(self, choices: _Choices) -> _Choices:
        """Return the choices with offsets of 0 at the last node, or without that node if the ends are given."""
        nodes, values = choices
        inner = nodes < self.nodes - 1
        if self.ends:
            return _Choices(nodes[inner], values[inner])
        last = values[~inner].copy()
        last[:, self.coordinates.carried :] = 0.0
        last = np.unique(last, axis=0)
        return _Choices(np.append(nodes[inner], np.full(len(last), self.nodes - 1)), np.vstack([values[inner], last]))

    def _costs(self, positions: FloatArray) -> FloatArray:
        if self.prefer != "weld_flat":
            return np.zeros(len(positions))
        return PREFERENCE_WEIGHT / self.nodes * tilts(self.coordinates.robot, positions)


def may_choose(coordinates: OpenCoordinates) -> bool:
    """Tell whether there are coordinates to choose, not too many, and the arm can reach any pose nearby."""
    return 0 < len(coordinates.lower) <= MOST_COORDINATES and coordinates.arm.dof >= 6
