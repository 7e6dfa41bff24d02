"""Poses: a position and, unless only the position matters, a rotation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

PoseLike: TypeAlias = "Pose | pin.SE3 | ArrayLike"

FloatArray = NDArray[np.float64]

GIMBAL_LOCK = 1e-6
"""Cosine of the pitch below which roll and yaw turn about one axis: poses are not solved well enough to tell them."""

SMALL_ANGLE = 1e-2
"""Angle, rad, below which a series takes the place of a difference that loses digits."""

NEAR_HALF_A_TURN = 0.1
"""Sine of an angle beyond a quarter turn below which the axis comes from the symmetric part of a rotation.

The antisymmetric part would lose a digit there, and all digits at half a turn.
"""

ROTATION_TOLERANCE = 1e-6
"""Largest entry of R^T R - I with which a matrix R counts as a rotation: people write them with six decimals."""

SMALL_SINE = 1e-9
"""Sine of an angle of rotation below which the angle equals it, without unit."""


@dataclass(frozen=True, eq=False)
class Pose:
    """A pose in the base frame.

    Attributes:
        position: (3,), m.
        rotation: (3, 3), in SO(3); None: any orientation will do.
    """

    position: FloatArray
    rotation: FloatArray | None = None

    if TYPE_CHECKING:

        def __init__(self, position: ArrayLike, rotation: ArrayLike | None = None) -> None: ...

    def __post_init__(self) -> None:
        """Take lists, too."""
        if not isinstance(self.position, np.ndarray):
            object.__setattr__(self, "position", np.array(self.position, dtype=np.float64))
        if self.rotation is not None and not isinstance(self.rotation, np.ndarray):
            object.__setattr__(self, "rotation", np.array(self.rotation, dtype=np.float64))

    @classmethod
    def from_rpy(cls, position: ArrayLike, rpy: ArrayLike) -> Pose:
        """Make a pose from angles about the fixed axes x, then y, then z (URDF): Rz(yaw) Ry(pitch) Rx(roll).

        Args:
            position: (3,), m.
            rpy: (3,), roll, pitch and yaw, rad.
        """
        roll, pitch, yaw = np.array(rpy, dtype=np.float64)
        return cls(np.array(position, dtype=np.float64), rotation_from_rpy(roll, pitch, yaw))

    @classmethod
    def from_quaternion(cls, position: ArrayLike, xyzw: ArrayLike) -> Pose:
        """Make a pose from a quaternion.

        Args:
            position: (3,), m.
            xyzw: (4,), x, y, z, w; it is normalised first.
        """
        quaternion = np.array(xyzw, dtype=np.float64)
        return cls(np.array(position, dtype=np.float64), rotation_from_quaternion(quaternion))

    def __repr__(self) -> str:
        """Return position and orientation in one line."""
        turned = "None" if self.rotation is None else np.round(quaternion(self.rotation), 6).tolist()
        return f"Pose({np.round(self.position, 6).tolist()}, xyzw={turned})"

    def from_frame(self, frame: Pose) -> Pose:
        """Express a pose given in a frame in the frame's parent: T_base_frame T_frame_pose.

        Args:
            frame: The frame's own pose; without a rotation, its axes are parallel to its parent's.
        """
        if frame.rotation is None:
            return Pose(frame.position + self.position, self.rotation)
        rotation = None if self.rotation is None else frame.rotation @ self.rotation
        return Pose(frame.position + frame.rotation @ self.position, rotation)

    def __matmul__(self, other: PoseLike) -> Pose:
        """Return the pose of `other`, given in this frame, in this frame's parent: T_base_frame @ T_frame_pose."""
        return as_pose(other).from_frame(self)

    def to_frame(self, frame: Pose) -> Pose:
        """Express a pose in a frame with the same parent: the inverse of `from_frame`.

        Args:
            frame: The frame's own pose; without a rotation, its axes are parallel to its parent's.
        """
        shift = self.position - frame.position
        if frame.rotation is None:
            return Pose(shift, self.rotation)
        return Pose(frame.rotation.T @ shift, None if self.rotation is None else frame.rotation.T @ self.rotation)


def as_pose(value: PoseLike, name: str = "pose") -> Pose:
    """Convert a `pin.SE3` or a homogeneous transform (4, 4) to a `Pose`; return a `Pose` as it is.

    Args:
        value: The pose, positions in m.
        name: Name of the argument, for the message of an error.

    Raises:
        TypeError: It is none of these.
        ValueError: The matrix is no rigid transform.

    Examples:
        >>> import numpy as np, planner
        >>> planner.as_pose(np.eye(4))
        Pose([0.0, 0.0, 0.0], xyzw=[0.0, 0.0, 0.0, 1.0])
    """
    if isinstance(value, Pose):
        return value
    if isinstance(value, pin.SE3):
        return Pose(value.translation.copy(), value.rotation.copy())
    expected = f"`{name}` must be a planner.Pose, a pinocchio.SE3 or a homogeneous transform (4, 4)"
    try:
        T = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise TypeError(f"{expected}; got {type(value).__name__}") from None
    if T.shape != (4, 4):
        raise TypeError(f"{expected}; got {type(value).__name__} of shape {T.shape}")
    bottom = np.abs(T[3] - (0.0, 0.0, 0.0, 1.0)).max()
    if not (np.isfinite(T).all() and bottom < ROTATION_TOLERANCE and is_rotation(T[:3, :3])):
        raise ValueError(f"`{name}` must have a rotation in its upper left 3 x 3 and the last row 0, 0, 0, 1; got {T}")
    return Pose(T[:3, 3].copy(), T[:3, :3].copy())


def convert_poses(record: object, *names: str) -> None:
    """Convert the poses in the fields of a frozen record by `as_pose`; None stays."""
    for name in names:
        value = getattr(record, name)
        if value is not None:
            object.__setattr__(record, name, as_pose(value, name))


def is_rotation(matrices: ArrayLike) -> np.ndarray:
    """Tell which matrices (..., 3, 3) are rotations, up to `ROTATION_TOLERANCE`: (...), bool."""
    R = np.asarray(matrices, dtype=np.float64)
    off = np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(axis=(-2, -1))
    right_handed = (np.cross(R[..., 0], R[..., 1]) * R[..., 2]).sum(axis=-1) > 0.0
    return np.asarray((off < ROTATION_TOLERANCE) & right_handed)


def rotation_x(angle: float) -> FloatArray:
    """Return the rotation (3, 3) about x by `angle` rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_y(angle: float) -> FloatArray:
    """Return the rotation (3, 3) about y by `angle` rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def rotation_z(angle: float) -> FloatArray:
    """Return the rotation (3, 3) about z by `angle` rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rotation_with_z_along(axis: FloatArray) -> FloatArray:
    """Return a rotation (3, 3) with the unit vector `axis` (3,) as z axis; exact for coordinate axes."""
    x = np.eye(3)[np.argmin(np.abs(axis))]
    x = x - axis * (axis @ x)
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Make a rotation (3, 3) of angles about the fixed axes x, then y, then z, rad: Rz(yaw) Ry(pitch) Rx(roll)."""
    return rotation_z(yaw) @ rotation_y(pitch) @ rotation_x(roll)


def rpy_from_rotations(rotations: ArrayLike) -> FloatArray:
    """Find roll, pitch and yaw (URDF) of consecutive rotations: R = Rz(yaw) Ry(pitch) Rx(roll).

    The pitch is in [-pi/2, pi/2]. Roll and yaw of the first rotation are in [-pi, pi]; the next ones differ from the
    one before by less than half a turn. So they never jump by a whole turn, and may leave this range. At a pitch of a
    quarter turn, only the sum or the difference of roll and yaw is defined. The roll then keeps its value, or is 0 at
    the first rotation.

    Args:
        rotations: (N, 3, 3).

    Returns:
        (N, 3), roll, pitch and yaw, rad.
    """
    R = np.asarray(rotations, dtype=np.float64)
    level = np.hypot(R[:, 0, 0], R[:, 1, 0])
    pitch = np.arctan2(-R[:, 2, 0], level)
    free = level > GIMBAL_LOCK
    last_free = np.maximum.accumulate(np.where(free, np.arange(len(R)), -1))
    roll = np.where(last_free >= 0, np.arctan2(R[:, 2, 1], R[:, 2, 2])[last_free], 0.0)
    # Without the roll what is left is Rz(yaw) Ry(pitch), whose second column tells the yaw whatever the pitch is.
    c, s = np.cos(roll), np.sin(roll)
    yaw = np.arctan2(s * R[:, 0, 2] - c * R[:, 0, 1], c * R[:, 1, 1] - s * R[:, 1, 2])
    return np.stack([np.unwrap(roll), pitch, np.unwrap(yaw)], axis=-1)


def rotation_from_quaternion(xyzw: FloatArray) -> FloatArray:
    """Make a rotation (3, 3) of a quaternion (4,) x, y, z, w, which is normalised first."""
    x, y, z, w = (
        xyzw / np.linalg.norm(xyzw)
    ).tolist()  # arithmetic on floats is ten times faster than on scalars of numpy
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotations_from_quaternions(xyzw: FloatArray) -> FloatArray:
    """Make rotations (N, 3, 3) of quaternions (N, 4) x, y, z, w, which are normalised first."""
    x, y, z, w = (xyzw / np.linalg.norm(xyzw, axis=1, keepdims=True)).T
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)


def quaternion(rotation: FloatArray) -> FloatArray:
    """Make the quaternion (4,) x, y, z, w with w >= 0 of a rotation (3, 3)."""
    xyzw: FloatArray = pin.Quaternion(rotation).coeffs()
    return -xyzw if xyzw[3] < 0.0 else xyzw


def rotation_vector(rotation: FloatArray) -> FloatArray:
    """Return the logarithm (3,) of one rotation (3, 3), as `rotation_vectors` does of many, but faster."""
    return np.asarray(pin.log3(rotation))


def rotation_vectors(rotations: FloatArray) -> FloatArray:
    """Return the logarithms (N, 3) of rotations (N, 3, 3); their lengths are the angles, rad, at most pi.

    Of the two at half a turn the one is returned whose component of largest magnitude is positive.
    """
    vectors: FloatArray = 0.5 * (rotations[:, [2, 0, 1], [1, 2, 0]] - rotations[:, [1, 2, 0], [2, 0, 1]])
    sines = np.linalg.norm(vectors, axis=1)
    cosines = 0.5 * (np.einsum("nii->n", rotations) - 1.0)
    angles = np.arctan2(sines, cosines)
    vectors *= np.where(sines > SMALL_SINE, angles / np.maximum(sines, SMALL_SINE), 1.0)[:, None]
    rows = np.flatnonzero((cosines < 0.0) & (sines < NEAR_HALF_A_TURN))
    if len(rows):  # the antisymmetric part, short there, has lost the axis a: the symmetric one is c 1 + (1 - c) a a^T
        turned = rotations[rows]
        symmetric = 0.5 * (turned + turned.transpose(0, 2, 1)) - cosines[rows, None, None] * np.eye(3)
        largest = np.einsum("nii->ni", symmetric).argmax(axis=1)
        axes = symmetric[np.arange(len(rows)), largest]
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        back = (axes * vectors[rows]).sum(axis=1) < 0.0
        vectors[rows] = np.where(back, -angles[rows], angles[rows])[:, None] * axes
    return vectors


def right_jacobians(vectors: FloatArray) -> FloatArray:
    """Return the right Jacobians J (N, 3, 3) of exp(w), which J dw turns where w (N, 3) changes."""
    x, y, z = vectors.T
    none = np.zeros_like(x)
    skew = np.array([[none, -z, y], [z, none, -x], [-y, x, none]]).transpose(2, 0, 1)
    squares = (vectors * vectors).sum(axis=1)[:, None, None]
    angles = np.sqrt(squares)
    versines = 0.5 * np.sinc(angles / (2.0 * np.pi)) ** 2
    small = squares < SMALL_ANGLE**2
    cubes = np.where(
        small, 1.0 / 6.0 - squares / 120.0, (1.0 - np.sinc(angles / np.pi)) / np.where(small, 1.0, squares)
    )
    jacobians: FloatArray = np.eye(3) - versines * skew + cubes * skew @ skew
    return jacobians


def rotations_from_vectors(vectors: FloatArray) -> FloatArray:
    """Return the rotations (N, 3, 3) about vectors (N, 3) by their lengths, rad: the formula of Rodrigues."""
    x, y, z = vectors.T
    none = np.zeros_like(x)
    skew = np.array([[none, -z, y], [z, none, -x], [-y, x, none]]).transpose(2, 0, 1)
    angles = np.linalg.norm(vectors, axis=1)[:, None, None]
    sines, versines = np.sinc(angles / np.pi), 0.5 * np.sinc(angles / (2.0 * np.pi)) ** 2
    rotations: FloatArray = np.eye(3) + sines * skew + versines * skew @ skew
    return rotations
