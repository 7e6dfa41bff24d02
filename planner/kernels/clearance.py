"""Distances among the convex pieces of a robot and a scene: bounds at joint positions, and proofs for whole motions."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple, Self

import numpy as np

from planner.kernels.library import call, doubles, indices
from planner.spatial import FloatArray

JOINT_NUMBERS = 14
"""Numbers in the structure `Joint` of the kernels."""

PIECE_NUMBERS = 18
"""Numbers in the structure `Piece` of the kernels."""

BOX_NUMBERS = 19
"""Numbers in the structure `Box` of the kernels."""

PLANE_NUMBERS = 4
"""Numbers in the structure `Plane` of the kernels."""

BALL_NUMBERS = 4
"""Numbers in the structure `Ball` of the kernels."""

FRAME_NUMBERS = 12
"""Numbers in the structure `Frame` of the kernels: a rotation, row by row, and an origin."""

PROOF_NUMBERS = 6
"""Numbers in the structure `Request` of the kernels."""

FOUND_NUMBERS = 21
"""Numbers in the structure `Found` of the kernels."""

MEASURE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int64, ctypes.POINTER(ctypes.c_double))
"""The function of C that measures a pair, see `Measured`."""

FAILED = 3
"""The code that such a function returns after an error: no kernel returns it."""

FREE_BLOCK = 0
"""The decision that all joint positions keep every margin."""

UNDECIDED_BLOCK = 1
"""The decision that neither of the others is proved."""

BLOCKED_BLOCK = 2
"""The decision that no joint position keeps every margin."""

PAIRS_AT_ONCE = 64
"""Number of pairs near each joint position for which memory is taken at first."""


class Measured(NamedTuple):
    """The distance of a pair for which GJK in the kernels has no proof.

    Attributes:
        proved: A lower bound of the signed distance, m.
        distance: An upper bound, m.
        normal: (3,), of a plane that proves it, from the first piece to the second; zero: there is none.
    """

    proved: float
    distance: float
    normal: FloatArray


class PieceArrays(NamedTuple):
    """A robot and a scene as the kernels read them; `planner.scene.arrays` fills it.

    Pairs are numbered: pairs of two bodies, then each body with each obstacle. Obstacles are boxes, then planes.

    Attributes:
        joints: (joints, `JOINT_NUMBERS`).
        pieces: (bodies + boxes, `PIECE_NUMBERS`).
        points: (3, points), m, of all pieces.
        boxes: (boxes, `BOX_NUMBERS`), about the obstacles that are bounded.
        planes: (planes, `PLANE_NUMBERS`).
        balls: (balls, `BALL_NUMBERS`), of point clouds.
        own: (2, own pairs), the bodies of these pairs.
        moved: (bodies, joints), 1 where a joint moves a body.
        own_margins: (own pairs,), m.
        margins: (bodies, obstacles), m; negative without end: the pair is not checked.
        kinds: (bodies, obstacles), 1 or 2.
        members: (obstacles,), the obstacles of all groups, one group after the other.
        group_ends: (groups,), where the members of each group end; each of the last `planes` groups is a plane.
        groups: (groups, `BALL_NUMBERS`), balls about the groups.
        group_margins: (2, bodies, groups), m, the largest margin of each kind.
    """

    joints: FloatArray
    pieces: FloatArray
    points: FloatArray
    boxes: FloatArray
    planes: FloatArray
    balls: FloatArray
    own: np.ndarray
    moved: np.ndarray
    own_margins: FloatArray
    margins: FloatArray
    kinds: np.ndarray
    members: np.ndarray
    group_ends: np.ndarray
    groups: FloatArray
    group_margins: FloatArray

    def checked(self) -> Self:
        """Return the arrays as the kernels read them.

        Raises:
            ValueError: An array has another shape, or an index is out of range.
        """
        joints, bodies, boxes, planes = len(self.joints), len(self.moved), len(self.boxes), len(self.planes)
        obstacles, groups = boxes + planes, len(self.groups)
        return self._replace(
            joints=doubles(self.joints, joints, JOINT_NUMBERS),
            pieces=doubles(self.pieces, bodies + boxes, PIECE_NUMBERS),
            points=doubles(self.points, 3, self.points.shape[1]),
            boxes=doubles(self.boxes, boxes, BOX_NUMBERS),
            planes=doubles(self.planes, planes, PLANE_NUMBERS),
            balls=doubles(self.balls, len(self.balls), BALL_NUMBERS),
            own=indices(self.own, bodies, 2, self.own.shape[1]),
            moved=indices(self.moved, 2, bodies, joints),
            own_margins=doubles(self.own_margins, self.own.shape[1]),
            margins=doubles(self.margins, bodies, obstacles),
            kinds=indices(self.kinds, 3, bodies, obstacles),
            members=indices(self.members, obstacles, obstacles),
            group_ends=indices(self.group_ends, obstacles + 1, groups),
            groups=doubles(self.groups, groups, BALL_NUMBERS),
            group_margins=doubles(self.group_margins, 2, bodies, groups),
        )

    def table(self) -> np.ndarray:
        """Return the sizes and addresses of checked arrays, as in the structure `Scene` of the kernels."""
        sizes = [len(self.joints), len(self.moved), len(self.boxes), len(self.planes), self.own.shape[1]]
        sizes += [len(self.groups), self.points.shape[1]]
        arrays = [self.joints, self.pieces, self.points, self.boxes, self.planes, self.balls, *self.own, *self[7:]]
        return np.array(sizes + [array.ctypes.data for array in arrays], dtype=np.int64)


class Found(NamedTuple):
    """The result of a proof. Pairs that were seen are rows of distance, m, time, s, and number; -1: none.

    Attributes:
        lower: (3,), m, that no pair of each kind falls short of; infinite where there is none.
        nearest: (3, 3), of each kind the nearest pair that was measured.
        hit: (3,), a pair that is too near.
        undecided: (3,), a pair that is not proved.
        intervals: Number of intervals that were looked at.
        distances: Number of distances.
    """

    lower: FloatArray
    nearest: FloatArray
    hit: FloatArray
    undecided: FloatArray
    intervals: int
    distances: int


class Distances:
    """The kernels of distances for one robot and scene."""

    def __init__(self, arrays: PieceArrays, measure: Callable[[FloatArray, FloatArray, int], Measured]) -> None:
        """Prepare for arrays, and a function of the joints' rotations (joints + 1, 3, 3), origins and a pair."""
        self._arrays, self._measure = arrays.checked(), measure
        self._table = self._arrays.table()

    def prove(
        self, lengths: FloatArray, coefficients: FloatArray, breakpoints: FloatArray, request: tuple[float, ...]
    ) -> Found:
        """Prove that a motion keeps its margins, or find a pair that does not.

        Args:
            lengths: (pieces,).
            coefficients: (pieces, joints, order).
            breakpoints: (pieces + 1,).
            request: (`PROOF_NUMBERS`,).
        """
        pieces, _, order = coefficients.shape
        motion = (
            doubles(lengths, pieces),
            doubles(coefficients, pieces, len(self._arrays.joints), order),
            doubles(breakpoints, pieces + 1),
        )
        found = np.empty(FOUND_NUMBERS)
        with self._measured() as (measure, frames):
            numbers = doubles(request, PROOF_NUMBERS)
            call("prove_clearance", self._table, pieces, order, *motion, numbers, measure, frames, found)
        seen = found[3:18].reshape(5, 3)
        return Found(found[:3], seen[:3], seen[3], seen[4], int(found[19]), int(found[20]))

    def near_pairs(
        self,
        positions: FloatArray,
        excursions: FloatArray,
        own_margin: float,
        margins: FloatArray,
        group_margins: FloatArray,
    ) -> tuple[np.ndarray, np.ndarray, FloatArray, FloatArray]:
        """Find the pairs at joint positions that cheap bounds leave nearer than margins.

        Args:
            positions: (N, joints).
            excursions: (N, joints), the largest changes of the joints.
            own_margin: Of two bodies, m, besides their own; negative without end: these pairs do not count.
            margins: (bodies, obstacles), m.
            group_margins: (bodies, groups), m, the largest.

        Returns:
            Row, number, bound of the distance, m, and of its change, m, of each pair.
        """
        count, joints = len(positions), len(self._arrays.joints)
        given = doubles(positions, count, joints), doubles(excursions, count, joints)
        both = np.stack([group_margins, group_margins])
        arrays = self._arrays._replace(margins=margins, group_margins=both).checked()
        room = PAIRS_AT_ONCE * count
        while True:
            rows, pairs, found = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int64), np.zeros(1, np.int64)
            bounds, motions = np.empty((2, room))
            out = rows, pairs, bounds, motions, found
            call("near_pairs", arrays.table(), count, *given, own_margin, room, *out)
            if (number := int(found[0])) <= room:
                return rows[:number], pairs[:number], bounds[:number], motions[:number]
            room = number

    def first_collision(self, positions: FloatArray, contact: float) -> int | None:
        """Find the first of joint positions (N, joints) that seems to be nearer than a margin less a contact, m.

        It proves nothing. None: all seem free.
        """
        blocked = np.flatnonzero(self._decided(positions, contact, stops=True) == BLOCKED_BLOCK)
        return int(blocked[0]) if len(blocked) else None

    def are_free(self, positions: FloatArray, contact: float) -> np.ndarray:
        """Tell (N,) which joint positions (N, joints) provably keep every margin less a contact, m."""
        return np.asarray(self._decided(positions, contact, stops=False) == FREE_BLOCK)

    def _decided(self, positions: FloatArray, contact: float, *, stops: bool) -> np.ndarray:
        """Decide joint positions (N, joints), on request up to the first blocked one."""
        count = len(positions)
        given, decisions = doubles(positions, count, len(self._arrays.joints)), np.empty(count, dtype=np.int64)
        with self._measured() as (measure, frames):
            call("decide_positions", self._table, count, given, contact, int(stops), measure, frames, decisions)
        return decisions

    def decide(self, positions: FloatArray, excursions: FloatArray, tries_blocked: np.ndarray) -> np.ndarray:
        """Decide the joint positions within excursions of some.

        Args:
            positions: (N, joints).
            excursions: (N, joints), the largest changes of the joints.
            tries_blocked: (N,), whether `BLOCKED_BLOCK` is tried too, which takes longer.

        Returns:
            (N,): `FREE_BLOCK`, all of them keep every margin; `BLOCKED_BLOCK`, none does; `UNDECIDED_BLOCK`.
        """
        count, joints = len(positions), len(self._arrays.joints)
        given = doubles(positions, count, joints), doubles(excursions, count, joints)
        tries, decisions = indices(tries_blocked, 2, count), np.empty(count, dtype=np.int64)
        with self._measured() as (measure, frames):
            call("decide_blocks", self._table, count, *given, tries, measure, frames, decisions)
        return decisions

    @contextmanager
    def _measured(self) -> Iterator[tuple[int, FloatArray]]:
        """Yield the address of a function that measures pairs, and the array of frames that it reads.

        An error of the function is raised when the kernel is left.
        """
        frames = np.empty((len(self._arrays.joints) + 1, FRAME_NUMBERS))
        errors: list[BaseException] = []

        def measure(pair: int, out: ctypes._Pointer[ctypes.c_double]) -> int:
            try:
                found = self._measure(frames[:, :9].reshape(-1, 3, 3), frames[:, 9:], pair)
                out[0], out[1] = found.proved, found.distance
                out[2], out[3], out[4] = found.normal.tolist()
            except BaseException as error:  # noqa: BLE001 - no error can pass the kernel
                errors.append(error)
                return FAILED
            return 0

        function = MEASURE(measure)
        address = ctypes.cast(function, ctypes.c_void_p).value
        if address is None:
            raise MemoryError("no memory left for a function of the kernels")
        try:
            yield address, frames
        finally:
            del function
        if errors:
            raise errors[0]
