"""The peaks of torques and of the tool's motion, bounded over whole intervals by Taylor models."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from planner.kernels.library import call, doubles, indices
from planner.kernels.serial_chain import LINK_NUMBERS, LOAD_NUMBERS

if TYPE_CHECKING:
    from planner.kernels.serial_chain import SerialChain
    from planner.spatial import FloatArray

KINDS = (
    "torque",
    "tcp_linear_velocity",
    "tcp_angular_velocity",
    "tcp_linear_acceleration",
    "tcp_angular_acceleration",
    "tcp_centripetal_acceleration",
    "tcp_linear_jerk",
    "tcp_angular_jerk",
    "power",
    "total_power",
    "torque_at_speed",
    "torque_with_tolerances",
    "path_position_deviation",
    "path_orientation_deviation",
)
"""The quantities that the kernels bound, in the order of their `Kind`."""

PATH_POWERS = 5
"""Highest power in the polynomials of a requested path."""

PATH_NUMBERS = 58
"""Numbers that describe a part of a requested path: the size of the structure `ToolPath` of the kernels."""

WISH_NUMBERS = 4
"""Numbers that say how accurate a bound is: the size of the structure `Wish` of the kernels."""


class Spread(Protocol):
    """Chains whose torques generate what may be added to the torques of another one.

    Attributes:
        chains: The links (chains, joints, `LINK_NUMBERS`).
        weights: (generators, chains): a generator is the sum of the torques of the chains by these factors. It may be
            added times any number from -1 to 1.
        load: The `SerialChain.load` of these chains.
    """

    @property
    def chains(self) -> FloatArray:
        """The links."""

    @property
    def weights(self) -> FloatArray:
        """The factors."""

    @property
    def load(self) -> FloatArray:
        """The load."""


class ToolChain(NamedTuple):
    """A serial chain with its tool.

    Attributes:
        chain: The joints and their links.
        tool_joints: The number of joints that move the tool.
        tool: (3,), m: the tool centre point in the frame of the last of these joints.
        axes: (3, 3): the axes of the tool in that frame, one in each row.
        spread: What may be added to torques; None: nothing.
    """

    chain: SerialChain
    tool_joints: int
    tool: FloatArray
    axes: FloatArray
    spread: Spread | None = None


class Motion(NamedTuple):
    """Pieces of a motion on unit time.

    Attributes:
        lengths: (pieces,), s.
        coefficients: (pieces, joints, order), ascending powers on [0, 1], rad or m.
        bernstein: Bernstein coefficients of the same shape.
    """

    lengths: FloatArray
    coefficients: FloatArray
    bernstein: FloatArray


class Columns(NamedTuple):
    """Functions of a motion, each with its limits.

    Attributes:
        kinds: (columns,), indices in `KINDS`.
        joints: (columns,), the joint of each torque and power.
        quantities: (columns,), the quantity that each function belongs to, from 0 on without gaps.
        middle: (pieces, columns), the middle between lower and upper limits.
        half: (pieces, columns), their distance from there; infinite: none.
    """

    kinds: np.ndarray
    joints: np.ndarray
    quantities: np.ndarray
    middle: FloatArray
    half: FloatArray


class ToolPaths(NamedTuple):
    """Paths that the tool follows, each of one or more parts.

    At a fraction u of a part its position is origin + the sum of u^k along[k - 1]. That of a circle is origin +
    cos(angle u) along[0] + sin(angle u) along[1]. The rotation is start exp(the sum of u^k turns[k - 1]).

    Attributes:
        of_piece: (pieces, 2): the first part of the path of each piece of the motion, and the number of its parts.
        numbers: (parts, `PATH_NUMBERS`). First the angle of a circle, rad; 0: a polynomial. Then its degree, start (9,
            row by row), turns (`PATH_POWERS`, 3), origin (3) and along (`PATH_POWERS`, 3). Then a sphere
            around the part: center (3) and radius. Then the tolerances of position and orientation, m and rad. Last two
            spheres in which the tool may leave the path: center (3) and radius; not positive: none.
    """

    of_piece: np.ndarray
    numbers: FloatArray


class BoundedPeaks(NamedTuple):
    """The peaks (quantities,) of all functions of each quantity, as shares of the limits there.

    Attributes:
        reached: A share that is reached.
        bound: A share that is exceeded nowhere.
        pieces: The piece on which `reached` is.
        units: Its unit time.
        columns: The function that reaches it.
    """

    reached: FloatArray
    bound: FloatArray
    pieces: np.ndarray
    units: FloatArray
    columns: np.ndarray

    @classmethod
    def nothing(cls, quantities: int) -> BoundedPeaks:
        """Return the peaks of no motion."""
        reached, bound, units = np.zeros((3, quantities))
        pieces, columns = np.zeros((2, quantities), dtype=np.int64)
        return cls(reached, bound, pieces, units, columns)


def bound_peaks(
    arm: ToolChain,
    motion: Motion,
    columns: Columns,
    wish: FloatArray,
    known: BoundedPeaks,
    curves: FloatArray,
    paths: ToolPaths | None = None,
) -> BoundedPeaks:
    """Bound the peaks of functions over all pieces of a motion.

    Args:
        arm: The robot.
        motion: Its motion.
        columns: The functions.
        wish: (`WISH_NUMBERS`,).
        known: The peaks of other pieces, which need not be bounded more closely than theirs.
        curves: Pieces (3, joints, pieces of a curve) of the joints' torque curves: last speed, intercept and slope.
        paths: The requested paths, for deviations from them.

    Returns:
        The peaks of these and of the other pieces. Where they changed, indices of pieces count in this motion.

    Raises:
        TooManySamples: The bounds would take more intervals than the wish says.
    """
    pieces, joints, order = motion.coefficients.shape
    count, quantities = len(columns.kinds), len(known.reached)
    found = BoundedPeaks(*(values.copy() for values in known))
    call(
        "bound_peaks",
        joints,
        doubles(arm.chain.links, joints, LINK_NUMBERS),
        doubles(arm.chain.load, LOAD_NUMBERS),
        arm.tool_joints,
        doubles(arm.tool, 3),
        doubles(arm.axes, 3, 3),
        pieces,
        order,
        doubles(motion.lengths, pieces),
        doubles(motion.coefficients, pieces, joints, order),
        doubles(motion.bernstein, pieces, joints, order),
        count,
        quantities,
        indices(columns.kinds, len(KINDS), count),
        indices(columns.joints, joints, count),
        indices(columns.quantities, quantities, count),
        doubles(columns.middle, pieces, count),
        doubles(columns.half, pieces, count),
        None if paths is None else indices(paths.of_piece, len(paths.numbers) + 1, pieces, 2),
        None if paths is None else doubles(paths.numbers, len(paths.numbers), PATH_NUMBERS),
        doubles(wish, WISH_NUMBERS),
        curves.shape[2],
        doubles(curves, 3, joints, curves.shape[2]),
        *_spread(arm.spread, joints),
        found.reached,
        found.bound,
        found.pieces,
        found.units,
        found.columns,
    )
    return found


def _spread(spread: Spread | None, joints: int) -> tuple[int, int, FloatArray, FloatArray, FloatArray]:
    """Return the sizes and arrays of a spread for the kernel."""
    if spread is None:
        return 0, 0, *np.zeros((3, 1))
    generators, chains = spread.weights.shape
    links = doubles(spread.chains, chains, joints, LINK_NUMBERS)
    return generators, chains, doubles(spread.weights, generators, chains), links, doubles(spread.load, LOAD_NUMBERS)
