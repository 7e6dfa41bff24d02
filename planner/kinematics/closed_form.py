"""All solutions of a pose at once, for arms whose axes allow it; for many poses in a few array operations.

The module recognises three kinds of arm. Three joints move a point (Pieper 1968). The last three of six axes meet in a
point. Or the second to fourth of six axes are parallel, and the last two meet. The angles come from the geometric
subproblems of Paden (1986) and Kahan, on the screws at joint position 0.

The results are candidates: the inverse kinematics refines and confirms each with Pinocchio.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from planner.kinematics.screws import Screws, meeting_point
from planner.spatial import FloatArray, rotation_with_z_along

ComplexArray = NDArray[np.complex128]

NEARLY_REAL = 1e-3
"""A candidate that exists but for so little (imaginary part, cosine beyond 1) is kept: polishing decides."""

PARALLEL_SINGULAR_VALUE = 1e-6
"""Singular value, relative to the largest, below which the first two axes of three count as meeting or parallel."""

OFFSET = 1.0
"""rad, from the angle that the tangent of the half angle cannot express: not one that arms tend to have."""

IN_HALF_TANGENT = np.array(
    [[np.cos(OFFSET), -np.sin(OFFSET), 0.0], [np.sin(OFFSET), np.cos(OFFSET), 0.0], [0.0, 0.0, 1.0]]
) @ np.array([[1.0, 0.0, -1.0], [0.0, 2.0, 0.0], [1.0, 0.0, 1.0]])
"""The matrix A with (1 + t^2) (cos q, sin q, 1) = A (1, t, t^2), t = tan((q - `OFFSET`) / 2)."""

EPSILON = 1e-9
"""Difference from 1 up to which the cosine of the angle between two axes counts them as parallel."""

LEAST = 1e-15
"""Least leading coefficient of a quartic, relative to the others."""

CHECKED_CONFIGURATIONS = 24
"""Number of random configurations that a form must find again from their poses."""

FOUND_AGAIN = 1e-2
"""Difference of an angle, rad, up to which a configuration counts as found again."""


ClosedForm: TypeAlias = Callable[[FloatArray, FloatArray | None], FloatArray]
"""Positions (N, 3) and rotations (N, 3, 3) to candidates (N, most, joints); NaN where there are fewer."""


def closed_form(screws: Screws, point: FloatArray | None) -> ClosedForm | None:
    """Return the form that finds random configurations of the arm again from where they bring the tip.

    Args:
        screws: The arm.
        point: (3,) of the tip frame, where its position alone counts; None: the tip's pose.
    """
    form = _form(screws, point)
    if form is not None or point is not None:
        return form
    back = _form(screws.reversed(), None)
    return None if back is None else FromTheTip(back)


class FromTheTip:
    """An arm whose form is that of the same arm from its tip to its base: it holds the workpiece under a fixed tool."""

    def __init__(self, form: ClosedForm) -> None:
        self.form = form

    def __call__(self, positions: FloatArray, rotations: FloatArray | None) -> FloatArray:
        """Find up to eight candidates."""
        assert rotations is not None  # noqa: S101 - six joints are asked for poses
        turned = rotations.transpose(0, 2, 1)
        return self.form(-(turned @ positions[..., None])[..., 0], turned)[..., ::-1]


def _form(screws: Screws, point: FloatArray | None) -> ClosedForm | None:
    """Return the form of the arm from its base to its tip, see `closed_form`."""
    joints = len(screws.axes)
    forms: list[ClosedForm] = []
    if point is None and joints == 6 and screws.is_angle[3:].all():
        if screws.is_angle.all():
            forms = [SphericalWrist(screws, ThreeJoints), ThreeParallel(screws)]
        elif screws.is_angle[0] and not screws.is_angle[1:3].any():
            forms = [SphericalWrist(screws, TurnAndSlides)]
    elif screws.is_angle.all() and point is not None and joints == 3:
        forms = [ThreeJoints(screws, screws.position + screws.rotation @ point)]
    samples = np.random.default_rng(0).uniform(-np.pi, np.pi, (CHECKED_CONFIGURATIONS, joints))
    for form in forms:
        positions, rotations, _ = screws.reach(samples, np.zeros(3) if point is None else point)
        with np.errstate(divide="ignore", invalid="ignore"):  # of an arm that has not what the form needs
            candidates = form(positions, rotations)
        away = (candidates - samples[:, None] + np.pi) % (2.0 * np.pi) - np.pi
        nearest = np.nan_to_num(np.abs(away).max(axis=2), nan=np.inf).min(axis=1)
        if (nearest < FOUND_AGAIN).all():
            return form
    return None


class SphericalWrist:
    """Six joints, the last three of whose axes meet: three bring that point to its place, three turn the tool."""

    def __init__(self, screws: Screws, arm: type[ThreeJoints] | type[TurnAndSlides]) -> None:
        self.screws = screws
        self.centre = meeting_point(screws.axes[3:], screws.points[3:])
        self.arm = arm(screws, self.centre)
        self.fourth, fifth, sixth = (_Axis(axis) for axis in screws.axes[3:])
        self.last, self.side = sixth.along, sixth.across.real
        self.last_seen = fifth.turned(self.last, self.fourth.across)
        self.last_height = fifth.turned(self.last, self.fourth.along)
        seen_by = self.fourth.across, self.fourth.across.conj(), self.fourth.along
        self.sixth_seen = [fifth.turned(sixth.across, direction) for direction in seen_by]

    def __call__(self, positions: FloatArray, rotations: FloatArray | None) -> FloatArray:
        """Find up to eight candidates."""
        turns, centres = _moved(self.screws, self.centre, positions, rotations)
        arm = self.arm(centres)
        # The last axis and a direction across it, as the forearm sees them.
        vectors = np.stack([turns @ self.last, turns @ self.side])[:, :, None]
        for i in np.flatnonzero(self.screws.is_angle[:3]):
            vectors = _turned(self.screws.cross[i], -arm[..., i], vectors)
        (last, side), (height, side_height) = vectors @ self.fourth.across, vectors @ self.fourth.along
        q5 = self.last_height.angles(height)
        turn5 = np.exp(1j * q5)
        q4 = _argument(last[..., None] * self.last_seen(turn5).conj())
        turn4 = np.exp(1j * q4)
        # The sixth axis's frame, turned by the fifth and the fourth joint, sees the direction across it at angle q6.
        ahead, back, along = (seen(turn5) for seen in self.sixth_seen)
        around = side[..., None].conj() * turn4 * ahead + side[..., None] * turn4.conj() * back
        q6 = _argument(0.5 * around + side_height[..., None] * along)
        return _joined(*arm.transpose(2, 0, 1)[..., None], q4, q5, q6)


class ThreeParallel:
    """Six joints, the second to fourth with parallel axes, the last two with axes that meet."""

    def __init__(self, screws: Screws) -> None:
        self.screws = screws
        self.centre = meeting_point(screws.axes[4:], screws.points[4:])
        self.first, second, _, _, fifth, sixth = (_Axis(axis) for axis in screws.axes)
        self.h, seen = second.along, second.across
        self.last, self.side, self.sixth = sixth.along, sixth.across.real, sixth.across
        self.last_height, self.last_seen = fifth.turned(self.last, self.h), fifth.turned(self.last, seen)
        self.sixth_seen = fifth.turned(sixth.across, seen), fifth.turned(sixth.across.conj(), seen)
        self.h_seen = fifth.turned(self.h, sixth.across)
        self.first_seen, self.first_height = self.first.seen(seen), self.first.seen(self.h)
        self.o1, o2, o3, o4 = screws.points[:4]
        self.to_fourth, self.to_second = (o4 - self.centre) @ seen, (o2 - self.o1) @ seen
        self.upper, self.fore = (o3 - o2) @ seen, (o4 - o3) @ seen
        self.bend = _Wave(self.upper.conjugate() * self.fore / 2.0, self.upper * self.fore.conjugate() / 2.0, 0.0)

    def __call__(self, positions: FloatArray, rotations: FloatArray | None) -> FloatArray:
        """Find up to eight candidates."""
        turns, centres = _moved(self.screws, self.centre, positions, rotations)
        # The parallel joints leave heights along their axes as they are: that of the centre tells the first joint.
        spoke, rise = self.first.parts(centres - self.o1)
        h, h_rise = self.first.parts(self.h)
        height = (self.centre - self.o1) @ self.h
        q1 = _angles_to_height(h * spoke.conj(), height - h_rise * rise)
        back = np.exp(-1j * q1)
        last, last_rise = self.first.parts(turns @ self.last)
        side, side_rise = self.first.parts(turns @ self.side)
        last, side, spoke = last[:, None] * back, side[:, None] * back, spoke[:, None] * back
        # That of the last axis tells the fifth joint.
        last_height = self.first_height(last, last_rise[:, None]).real
        q5 = self.last_height.angles(last_height)
        turn5 = np.exp(1j * q5)
        # Where the sixth joint's frame sees h when the arm is as requested, and where before its turn.
        h_turned = (
            turns.transpose(0, 2, 1)[:, None]
            @ ((h * back.conj())[..., None] * self.first.across.conj() + h_rise * self.first.along).real[..., None]
        )
        h_there = h_turned[..., 0] @ self.sixth
        q6 = _argument(self.h_seen(turn5.conj()) * h_there[..., None].conj())
        turn6 = np.exp(1j * q6)
        # What the parallel joints turn together: seen on the last axis and on a direction across it.
        ahead, behind = (seen(turn5) for seen in self.sixth_seen)
        side_before = 0.5 * (turn6.conj() * ahead + turn6 * behind)
        last_after, side_after = self.first_seen(last, last_rise[:, None]), self.first_seen(side, side_rise[:, None])
        both = last_after[..., None] * self.last_seen(turn5).conj() + side_after[..., None] * side_before.conj()
        together = _argument(both)
        # Where the fourth axis is then, and two links that reach it.
        centre = self.first_seen(spoke, rise[:, None]) - self.to_second
        reach = centre[..., None] + np.exp(1j * together) * self.to_fourth
        squared = reach.real**2 + reach.imag**2
        q3 = self.bend.angles((squared - abs(self.upper) ** 2 - abs(self.fore) ** 2) / 2.0)
        # Where the last axis is parallel too, another q6 may be in reach: something to start from.
        q3 = np.where(np.isnan(q3) & (np.abs(last_height) > 1.0 - EPSILON)[..., None, None], 0.0, q3)
        q2 = _argument(reach[..., None] * (self.upper + self.fore * np.exp(1j * q3)).conj())
        q4 = together[..., None] - q2 - q3
        return _joined(q1[..., None, None], q2, q3, q4, q5[..., None], q6[..., None])


class ThreeJoints:
    """Three revolute joints that move a point to a place.

    Let d lead from the first axis to a point of the second. Let v lead from there to the point, turned by the third
    joint alone. Then u = Rot2 v must have the right height along the first axis and the right distance from it. Both
    are linear in the part of u across the second axis, which the second joint does not lengthen: K u = g(q3), |u| =
    |v(q3)|. That is a quartic in tan(q3 / 2); where K is singular (the first two axes meet or are parallel) a quadratic
    and a sign.
    """

    def __init__(self, screws: Screws, point: FloatArray) -> None:
        (h1, h2, h3), (o1, o2, o3) = screws.axes[:3], screws.points[:3]
        self.d = o2 - o1 - ((o2 - o1) @ h1) * h1
        self.o2 = o2
        arm = point - o3
        along = (arm @ h3) * h3
        self.v = np.array([arm - along, screws.cross[2] @ arm, o3 - o2 + along]).T  # times (cos q3, sin q3, 1)
        self.across = rotation_with_z_along(h2)[:, :2].T
        self.first = _Axis(h1)
        # Of u as the first axis sees it: what d gives, what the part along the second axis gives, and the part across.
        self.d_seen, self.along_seen, self.across_seen = (v @ self.first.across for v in (self.d, h2, self.across))
        self.left, self.values, self.right = np.linalg.svd(np.array([h1, self.d]) @ self.across.T)
        self.is_flat = bool(self.values[1] <= PARALLEL_SINGULAR_VALUE * self.values[0])
        self.v_along, self.v_across = h2 @ self.v, self.across @ self.v
        offset, link = self.v[:, 2], self.v[:, :2]
        squared = np.array([*(2.0 * offset @ link), offset @ offset + link[:, 0] @ link[:, 0]])  # |v|^2
        self.g = np.array([-(h1 @ h2) * self.v_along, -0.5 * squared - (self.d @ h2) * self.v_along])

    def __call__(self, positions: FloatArray, rotations: FloatArray | None = None) -> FloatArray:
        """Find up to four candidates."""
        from_second = positions - self.o2
        from_first = from_second + self.d
        g = np.repeat(self.g[None], len(positions), axis=0)
        g[:, 0, 2] += from_second @ self.first.along
        g[:, 1, 2] += 0.5 * ((from_first * from_first).sum(axis=1) - self.d @ self.d)
        g = self.left.T @ g
        if self.is_flat:
            q3 = np.repeat(_angles_to_height(g[:, 1, 0] - 1j * g[:, 1, 1], -g[:, 1, 2]), 2, axis=1)
            x = _circle(q3)
            first = (x @ g[:, 0, :, None])[..., 0] / self.values[0]
            second = _root(((x @ self.v_across.T) ** 2).sum(axis=-1), first**2) * np.array([1.0, -1.0, 1.0, -1.0])
            u = np.stack([first, second], axis=-1) @ self.right
        else:
            u_of = self.right.T @ (g / self.values[:, None])
            q3 = _roots(u_of.transpose(0, 2, 1) @ u_of - self.v_across.T @ self.v_across)
            x = _circle(q3)
            u = x @ u_of.transpose(0, 2, 1)
        v = x @ self.v_across.T
        q2 = np.arctan2(u[..., 1], u[..., 0]) - np.arctan2(v[..., 1], v[..., 0])
        seen = self.d_seen + (x @ self.v_along) * self.along_seen + u @ self.across_seen
        q1 = _argument((from_first @ self.first.across)[:, None] * seen.conj())
        return np.stack([q1, q2, q3], axis=-1)


class TurnAndSlides:
    """One revolute and two prismatic joints that move a point to a place.

    Its height along the axis of rotation and its distance from that axis determine the slides.
    """

    def __init__(self, screws: Screws, point: FloatArray) -> None:
        self.axis, self.about, self.origin = screws.axes[0], screws.cross[0], screws.points[0]
        self.slides = screws.axes[1:3]
        self.arm = point - self.origin

    def __call__(self, positions: FloatArray, rotations: FloatArray | None = None) -> FloatArray:
        """Find up to two candidates."""
        wanted = positions - self.origin
        _, (lift,), (rising, level) = np.linalg.svd((self.slides @ self.axis)[None])
        rising = rising / max(lift, PARALLEL_SINGULAR_VALUE) * np.sign(rising @ self.slides @ self.axis)
        shift = ((wanted - self.arm) @ self.axis)[:, None] * rising
        # Along `level` the slides keep the height: the distance is a quadratic in how far.
        start, way = self.arm + shift @ self.slides, level @ self.slides
        half = start @ way / (way @ way)
        rest = ((start**2).sum(axis=1) - (wanted**2).sum(axis=1)) / (way @ way)
        far = -half[:, None] + _root(half**2, rest)[:, None] * np.array([1.0, -1.0])
        before, after = start[:, None] + far[..., None] * way, wanted[:, None]
        across = before @ self.about.T  # a turn about the axis takes the one to the other
        q1 = np.arctan2((across * after).sum(axis=-1), -(across @ self.about.T * after).sum(axis=-1))
        return np.concatenate([q1[..., None], shift[:, None] + far[..., None] * level], axis=-1)


class _Axis:
    """A joint's axis. Vectors are a complex number across it and a height along it; a turn multiplies the number.

    Attributes:
        across: (3,), complex: x + i y of a right-handed frame whose z is the axis.
        along: (3,): the axis.
    """

    def __init__(self, axis: FloatArray) -> None:
        x, y, _ = rotation_with_z_along(axis).T
        self.across, self.along = x + 1j * y, axis

    def parts(self, vectors: FloatArray) -> tuple[ComplexArray, FloatArray]:
        """Return the numbers and the heights (...) of vectors (..., 3)."""
        return vectors @ self.across, vectors @ self.along

    def seen(self, direction: ComplexArray | FloatArray) -> _Wave:
        """Return the product of a direction (3,), real or complex, with vectors that are given by number and height."""
        number, conjugate = 0.5 * self.across.conj() @ direction, 0.5 * self.across @ direction
        return _Wave(number, conjugate, complex(self.along @ direction))

    def turned(self, vector: ComplexArray | FloatArray, direction: ComplexArray | FloatArray) -> _Wave:
        """Return the product of a direction (3,) with the turned vector (3,), as a function of exp(i q)."""
        wave = self.seen(direction)
        number, conjugate = vector @ self.across, vector @ self.across.conj()
        return _Wave(wave.number * number, wave.conjugate * conjugate, wave.constant * complex(vector @ self.along))


class _Wave(NamedTuple):
    """The function a z + b conj(z) + c h of a complex number z and a height h.

    Attributes:
        number: The factor a.
        conjugate: The factor b.
        constant: The factor c.
    """

    number: complex
    conjugate: complex
    constant: complex

    def __call__(self, number: ComplexArray, height: FloatArray | float = 1.0) -> ComplexArray:
        """Return the value (...)."""
        return self.number * number + self.conjugate * number.conj() + self.constant * height

    def angles(self, value: FloatArray) -> FloatArray:
        """Return the angles q (..., 2) at which a real function has a value (...), z = exp(i q), h = 1."""
        return _angles_to_height(np.asarray(2.0 * self.number), value - complex(self.constant).real)


def _moved(
    screws: Screws, point: FloatArray, positions: FloatArray, rotations: FloatArray | None
) -> tuple[FloatArray, ...]:
    """Return the rotations (N, 3, 3) of the tip since joint position 0, and the moved point (N, 3)."""
    assert rotations is not None  # noqa: S101 - six joints are asked for poses
    turns = rotations @ screws.rotation.T
    return turns, positions + turns @ (point - screws.position)


def _turned(cross: FloatArray, angle: FloatArray, vectors: FloatArray) -> FloatArray:
    """Turn vectors (..., 3) about an axis, by Rodrigues' formula."""
    across = vectors @ cross.T
    return vectors + np.sin(angle)[..., None] * across + (1.0 - np.cos(angle))[..., None] * across @ cross.T


def _angles_to_height(number: ComplexArray, height: FloatArray) -> FloatArray:
    """Return the angles q (..., 2) with Re(number exp(i q)) = height."""
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = height / np.abs(number)
    half = np.arccos(np.minimum(np.maximum(np.where(np.abs(cosine) < 1.0 + NEARLY_REAL, cosine, np.nan), -1.0), 1.0))
    middle = -_argument(number)
    angles = np.empty((*half.shape, 2))
    angles[..., 0], angles[..., 1] = middle + half, middle - half
    return angles


def _joined(*angles: FloatArray) -> FloatArray:
    """Combine angles (N, ...) that broadcast against the fourth into candidates (N, most, joints)."""
    joined = np.empty((*angles[3].shape, len(angles)))
    for joint, values in enumerate(angles):
        joined[..., joint] = values
    return joined.reshape(len(joined), -1, len(angles))


def _argument(numbers: ComplexArray) -> FloatArray:
    """Return the arguments (...), rad, of complex numbers (...); `np.angle` takes three times as long for a few."""
    return np.arctan2(numbers.imag, numbers.real)


def _root(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the root of a - b; 0 where it lacks but little."""
    exists = a - b > -NEARLY_REAL * (np.abs(a) + np.abs(b))
    return np.sqrt(np.maximum(np.where(exists, a - b, np.nan), 0.0))


def _circle(angle: FloatArray) -> FloatArray:
    return np.stack([np.cos(angle), np.sin(angle), np.ones_like(angle)], axis=-1)


def _roots(forms: FloatArray) -> FloatArray:
    """Solve x^T Q x = 0, x = (cos q, sin q, 1), for angles q (N, 4)."""
    Q = IN_HALF_TANGENT.T @ forms @ IN_HALF_TANGENT
    least = np.maximum(LEAST * np.abs(Q).max(axis=(1, 2)), np.finfo(float).tiny)
    leading = np.where(np.abs(Q[:, 2, 2]) < least, least, Q[:, 2, 2])
    companion = np.zeros((len(Q), 4, 4))
    companion[:, 1:, :3] = np.eye(3)
    lower = [Q[:, 0, 0], 2.0 * Q[:, 0, 1], 2.0 * Q[:, 0, 2] + Q[:, 1, 1], 2.0 * Q[:, 1, 2]]
    companion[:, :, 3] = -np.stack(lower, axis=1) / leading[:, None]
    t = np.linalg.eigvals(companion)
    real = np.abs(t.imag) < NEARLY_REAL * (1.0 + t.real**2)
    return np.where(real, OFFSET + 2.0 * np.arctan(t.real), np.nan)
