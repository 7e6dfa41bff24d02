"""The peaks of torques and of the tool's motion, bounded over whole intervals by Taylor models."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from planner.kernels.library import call, doubles, indices
from planner.kernels.serial_chain import LINK_NUMBERS, LOAD_NUMBERS, MAGNITUDE_NUMBERS, SerialChain
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
    "acceleration_at_speed",
    "jerk_at_speed",
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
        loads: (chains, `LOAD_NUMBERS`), the `SerialChain.load` of these chains.
        magnitudes: (joints + 1, `MAGNITUDE_NUMBERS`): `torque_magnitudes` of them are added; no rows: nothing is.
    """

    @property
    def chains(self) -> FloatArray:
        """The links."""

    @property
    def weights(self) -> FloatArray:
        """The factors."""

    @property
    def loads(self) -> FloatArray:
        """The loads."""

    @property
    def magnitudes(self) -> FloatArray:
        """The numbers of the remainder."""


class ToolChain(NamedTuple):
    """A serial chain with its tool.

    Attributes:
        chain: The joints and their links.
        tool_joints: The number of joints that move the tool.
        tool: (3,), m: the tool centre point in the frame of the last of these joints.
        axes: (3, 3): the axes of the tool in that frame, one in each row.
        spread: What may be added to torques; None: nothing.
        following: (3, joints): following errors, levers of the tool and whether each joint turns, see
            `tool_differences`; None: no following errors.
    """

    chain: SerialChain
    tool_joints: int
    tool: FloatArray
    axes: FloatArray
    spread: Spread | None = None
    following: FloatArray | None = None


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
        curves: Pieces (3, 3, joints, pieces of a curve) of the limits of torque, acceleration and jerk by speed of the
            joints: last speed, intercept and slope.
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
        curves.shape[3],
        doubles(curves, 3, 3, joints, curves.shape[3]),
        *_spread(arm.spread, joints),
        None if arm.following is None else doubles(arm.following, 3, joints),
        found.reached,
        found.bound,
        found.pieces,
        found.units,
        found.columns,
    )
    return found


def tool_differences(
    following: FloatArray, tool_joints: int, order: int, is_angular: bool, rates: FloatArray
) -> FloatArray:
    """Bound the differences (states,) of derivatives of the tool's pose by following errors of the joints.

    Args:
        following: (3, joints). First the errors, then the largest distances of the tool from the axes of joints that
            turn, or 1 for joints that slide. Last, 1 for a joint that turns or 0.
        tool_joints: The number of joints that move the tool.
        order: Of the derivative by time, 1 to 3.
        is_angular: Whether the derivative is of the tool's turn, not of its position.
        rates: (states, order, joints): velocities, accelerations and jerks of the joints.
    """
    states, _, joints = rates.shape
    differences = np.empty(states)
    errors, motion = doubles(following, 3, joints), doubles(np.abs(rates), states, order, joints)
    call("tool_differences", joints, tool_joints, errors, order, int(is_angular), states, motion, differences)
    return differences


def _spread(spread: Spread | None, joints: int) -> tuple[int | NDArray[np.float64] | None, ...]:
    """Return the sizes and arrays of a spread for the kernel."""
    if spread is None:
        return 0, 0, *np.zeros((3, 1)), None
    generators, chains = spread.weights.shape
    links = doubles(spread.chains, chains, joints, LINK_NUMBERS)
    loads = doubles(spread.loads, chains, LOAD_NUMBERS)
    remainder = doubles(spread.magnitudes, joints + 1, MAGNITUDE_NUMBERS) if len(spread.magnitudes) else None
    return generators, chains, doubles(spread.weights, generators, chains), links, loads, remainder
