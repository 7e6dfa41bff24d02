"""All solutions of a pose at once, for arms whose axes allow it; for many poses in a few array operations.

Three kinds of arm, told apart by trying: three joints that bring a point somewhere (Pieper 1968); six joints, the last
three axes of which meet in a point; six, the second to fourth axis parallel and the last two meeting. The
angles come from the geometric subproblems of Paden (1986) and Kahan, on the screws at joint position 0.

What comes out are candidates: the inverse kinematics polish and confirm each with Pinocchio.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from planner.kinematics.screws import Screws
    from planner.spatial import FloatArray

NEARLY = 1e-3
"""A candidate that exists but for so little (imaginary part, cosine beyond 1) is kept: polishing decides."""

NEARLY_PARALLEL = 0.9
"""Cosine of the angle between axes from which on one does not tell the turn about the other."""

FLAT = 1e-6
"""Singular value, relative to the largest, below which the first two axes of three count as meeting or parallel."""

OFFSET = 1.0
"""rad, from the angle that the tangent of the half angle cannot express: not one that arms tend to have."""

EPSILON = 1e-9
"""What the cosine of the angle between parallel axes lacks of 1."""

LEAST = 1e-15
"""Least leading coefficient of a quartic, relative to the others."""

SAMPLES, FOUND_AGAIN = 24, 1e-2
"""Random configurations that a form must find again from their poses, and how nearly, rad."""


class ClosedForm(Protocol):
    """Candidates (N, most, joints) for positions (N, 3) and rotations (N, 3, 3); NaN where there are fewer."""

    def __call__(self, positions: FloatArray, rotations: FloatArray | None) -> FloatArray:
        """Solve."""


def closed_form(screws: Screws, point: FloatArray | None) -> ClosedForm | None:
    """The form that finds random configurations of the arm again from where they bring the tip.

    Args:
        screws: The arm.
        point: (3,) of the tip frame, where its position alone counts; None: the tip's pose.
    """
    joints = len(screws.axes)
    forms: list[ClosedForm] = []
    if point is None and joints == 6 and screws.is_angle[3:].all():
        if screws.is_angle.all():
            forms = [SphericalWrist(screws, ThreeJoints), ThreeParallel(screws)]
        elif screws.is_angle[0] and not screws.is_angle[1:3].any():
            forms = [SphericalWrist(screws, TurnAndSlides)]
    elif screws.is_angle.all() and point is not None and joints == 3:
        forms = [ThreeJoints(screws, screws.position + screws.rotation @ point)]
    samples = np.random.default_rng(0).uniform(-np.pi, np.pi, (SAMPLES, joints))
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
        self.centre = _meeting_point(screws.axes[3:], screws.points[3:])
        self.arm = arm(screws, self.centre)
        self.side = _frame_about(screws.axes[5])[0]

    def __call__(self, positions: FloatArray, rotations: FloatArray | None) -> FloatArray:
        """Up to eight."""
        axes, cross = self.screws.axes, self.screws.cross
        turns, centres = _moved(self.screws, self.centre, positions, rotations)
        arm = self.arm(centres)[:, :, None]
        angles = np.where(self.screws.is_angle[:3], arm, 0.0)
        # The last axis, and a direction across it, as the forearm sees them.
        last, side = (turns @ axes[5])[:, None, None], (turns @ self.side)[:, None, None]
        for i in range(3):
            last, side = _turned(cross[i], -angles[..., i], last), _turned(cross[i], -angles[..., i], side)
        q5 = _angles_to_height(cross[4], axes[5], axes[3], (last @ axes[3])[..., 0])
        q4 = _angle(cross[3], _turned(cross[4], q5, axes[5]), last)
        q6 = _angle(cross[5], self.side, _turned(cross[4], -q5, _turned(cross[3], -q4, side)))
        wrist = np.stack([q4, q5, q6], axis=-1)
        both = np.concatenate([np.broadcast_to(arm, wrist.shape), wrist], axis=-1)
        return both.reshape(len(positions), -1, 6)


class ThreeParallel:
    """Six joints, the second to fourth with parallel axes, the last two with axes that meet."""

    def __init__(self, screws: Screws) -> None:
        self.screws = screws
        self.centre = _meeting_point(screws.axes[4:], screws.points[4:])
        self.side = _frame_about(screws.axes[5])[0]

    def __call__(self, positions: FloatArray, rotations: FloatArray | None) -> FloatArray:
        """Up to eight."""
        axes, cross, (o1, o2, o3, o4) = self.screws.axes, self.screws.cross, self.screws.points[:4]
        h, about_h = axes[1], cross[1]
        turns, centres = _moved(self.screws, self.centre, positions, rotations)
        # The parallel joints leave heights along h as they are.
        q1 = -_angles_to_height(cross[0], centres - o1, h, (self.centre - o1) @ h)[..., None]
        centre = o1 + _turned(cross[0], -q1, (centres - o1)[:, None, None])
        last = _turned(cross[0], -q1, (turns @ axes[5])[:, None, None])
        q5 = _angles_to_height(cross[4], axes[5], h, (last @ h)[..., 0])
        h_seen = np.einsum("nji,n...j->n...i", turns, _turned(cross[0], q1, h))
        q6 = -_angle(cross[5], _turned(cross[4], -q5, h), h_seen)
        # What the parallel joints turn together: seen on the last axis, or where that is parallel too, across it.
        side = _turned(cross[4], q5, _turned(cross[5], q6, self.side))
        parallel = np.abs(last @ h)[..., None] > NEARLY_PARALLEL
        before = np.where(parallel, side, _turned(cross[4], q5, axes[5]))
        after = np.where(parallel, _turned(cross[0], -q1, (turns @ self.side)[:, None, None]), last)
        together = _angle(about_h, before, after)
        # Where the fourth axis is then, and two links that reach it.
        reach = centre + _turned(about_h, together, o4 - self.centre) - o2
        reach = reach - (reach @ h)[..., None] * h
        upper, fore = (link - (link @ h) * h for link in (o3 - o2, o4 - o3))
        q3 = _angles_to_height(about_h, fore, upper, ((reach**2).sum(axis=-1) - upper @ upper - fore @ fore) / 2.0)
        # Where the last axis is parallel too, another q6 may be in reach: something to start from.
        q3 = np.where(np.isnan(q3) & (np.abs(last @ h) > 1.0 - EPSILON)[..., None], 0.0, q3)
        q2 = _angle(about_h, upper + _turned(about_h, q3, fore), reach[..., None, :])
        q1, q5, q6, together = q1[..., None], q5[..., None], q6[..., None], together[..., None]
        parts = np.broadcast_arrays(q1, q2, q3, together - q2 - q3, q5, q6)
        return np.stack(parts, axis=-1).reshape(len(positions), -1, 6)


class ThreeJoints:
    """Three revolute joints that bring a point to a place.

    With d from the first axis to a point of the second and v from there to the point, turned by the third joint alone,
    u = Rot2 v must have the right height along the first axis and the right distance from it. Both are linear in the
    part of u across the second axis, which the second joint does not lengthen: K u = g(q3), |u| = |v(q3)|. That is a
    quartic in tan(q3 / 2); where K is singular (the first two axes meet or are parallel) a quadratic and a sign.
    """

    def __init__(self, screws: Screws, point: FloatArray) -> None:
        self.h, self.about_h1, (o1, o2, o3) = screws.axes[:3], screws.cross[0], screws.points[:3]
        h1, h2, h3 = self.h
        self.d = o2 - o1 - ((o2 - o1) @ h1) * h1
        self.o2 = o2
        arm = point - o3
        along = (arm @ h3) * h3
        self.v = np.array([arm - along, screws.cross[2] @ arm, o3 - o2 + along]).T  # times (cos q3, sin q3, 1)
        self.across = _frame_about(h2)
        self.K = np.array([h1, self.d]) @ self.across.T

    def __call__(self, positions: FloatArray, rotations: FloatArray | None = None) -> FloatArray:
        """Up to four."""
        h1, h2, _ = self.h
        along, across = h2 @ self.v, self.across @ self.v
        offset, link = self.v[:, 2], self.v[:, :2]
        squared = np.array([*(2.0 * offset @ link), offset @ offset + link[:, 0] @ link[:, 0]])  # |v|^2
        from_second = positions - self.o2
        from_first = from_second + self.d
        g = np.empty((len(positions), 2, 3))
        g[:, 0] = -(h1 @ h2) * along
        g[:, 1] = -0.5 * squared - (self.d @ h2) * along
        g[:, 0, 2] += from_second @ h1
        g[:, 1, 2] += 0.5 * ((from_first**2).sum(axis=1) - self.d @ self.d)
        left, values, right = np.linalg.svd(self.K)
        if values[1] > FLAT * values[0]:
            u_of = np.linalg.solve(self.K, g)
            q3 = _roots(u_of.transpose(0, 2, 1) @ u_of - across.T @ across)
            x = _circle(q3)
            u = np.einsum("nij,nkj->nki", u_of, x)
        else:
            g = left.T @ g
            q3 = np.repeat(_angles(g[:, 1, 0], g[:, 1, 1], -g[:, 1, 2]), 2, axis=1)
            x = _circle(q3)
            first = np.einsum("nj,nkj->nk", g[:, 0], x) / values[0]
            second = _root(((x @ across.T) ** 2).sum(axis=-1), first**2) * np.array([1.0, -1.0, 1.0, -1.0])
            u = np.stack([first, second], axis=-1) @ right
        v = x @ across.T
        q2 = np.arctan2(u[..., 1], u[..., 0]) - np.arctan2(v[..., 1], v[..., 0])
        q1 = _angle(self.about_h1, self.d + (x @ along)[..., None] * h2 + u @ self.across, from_first[:, None])
        return np.stack([q1, q2, q3], axis=-1)


class TurnAndSlides:
    """A joint that turns and two that slide, which bring a point to a place.

    What the slides must do is known by its height along the axis of the turn and by the distance from that axis.
    """

    def __init__(self, screws: Screws, point: FloatArray) -> None:
        self.axis, self.about, self.origin = screws.axes[0], screws.cross[0], screws.points[0]
        self.slides = screws.axes[1:3]
        self.arm = point - self.origin

    def __call__(self, positions: FloatArray, rotations: FloatArray | None = None) -> FloatArray:
        """Up to two."""
        wanted = positions - self.origin
        _, (lift,), (rising, level) = np.linalg.svd((self.slides @ self.axis)[None])
        rising = rising / max(lift, FLAT) * np.sign(rising @ self.slides @ self.axis)
        shift = ((wanted - self.arm) @ self.axis)[:, None] * rising
        # Along `level` the slides keep the height: the distance is a quadratic in how far.
        start, way = self.arm + shift @ self.slides, level @ self.slides
        half = start @ way / (way @ way)
        rest = ((start**2).sum(axis=1) - (wanted**2).sum(axis=1)) / (way @ way)
        far = -half[:, None] + _root(half**2, rest)[:, None] * np.array([1.0, -1.0])
        q1 = _angle(self.about, start[:, None] + far[..., None] * way, wanted[:, None])
        return np.concatenate([q1[..., None], shift[:, None] + far[..., None] * level], axis=-1)


def _moved(
    screws: Screws, point: FloatArray, positions: FloatArray, rotations: FloatArray | None
) -> tuple[FloatArray, ...]:
    """How the tip has turned since joint position 0 (N, 3, 3), and where it has taken a point (N, 3)."""
    assert rotations is not None  # noqa: S101 - six joints are asked for poses
    turns = rotations @ screws.rotation.T
    return turns, positions + turns @ (point - screws.position)


def _meeting_point(axes: FloatArray, points: FloatArray) -> FloatArray:
    """The point nearest to all lines, in the sense of least squares."""
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    return np.asarray(np.linalg.lstsq(across.reshape(-1, 3), (across @ points[:, :, None]).ravel(), rcond=None)[0])


def _frame_about(axis: FloatArray) -> FloatArray:
    """(2, 3): two directions that make a right-handed frame with an axis."""
    first = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(axis, first)])


def _turned(cross: FloatArray, angle: FloatArray, vectors: FloatArray) -> FloatArray:
    """Vectors (..., 3) turned about an axis, by Rodrigues' formula."""
    across = vectors @ cross.T
    turned: FloatArray = (
        vectors + np.sin(angle)[..., None] * across + (1.0 - np.cos(angle))[..., None] * across @ cross.T
    )
    return turned


def _angle(cross: FloatArray, before: FloatArray, after: FloatArray) -> FloatArray:
    """By which a turn about an axis takes one vector (..., 3) to the other."""
    across = before @ cross.T
    angle: FloatArray = np.arctan2((across * after).sum(axis=-1), -(across @ cross.T * after).sum(axis=-1))
    return angle


def _angles(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """(..., 2): the solutions of a cos q + b sin q = c."""
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = c / np.hypot(a, b)
    half = np.arccos(np.clip(np.where(np.abs(cosine) < 1.0 + NEARLY, cosine, np.nan), -1.0, 1.0))
    middle = np.arctan2(b, a)
    return np.stack([middle + half, middle - half], axis=-1)


def _angles_to_height(cross: FloatArray, vectors: FloatArray, up: FloatArray, height: FloatArray) -> FloatArray:
    """(..., 2): turns about an axis that bring vectors (..., 3) to a height along `up`."""
    b, a = vectors @ cross.T @ up, -(vectors @ cross.T @ cross.T @ up)
    return _angles(a, b, height - (vectors @ up - a))


def _root(a: FloatArray, b: FloatArray) -> FloatArray:
    """The root of a - b; 0 where it lacks but little."""
    exists = a - b > -NEARLY * (np.abs(a) + np.abs(b))
    return np.sqrt(np.maximum(np.where(exists, a - b, np.nan), 0.0))


def _circle(angle: FloatArray) -> FloatArray:
    return np.stack([np.cos(angle), np.sin(angle), np.ones_like(angle)], axis=-1)


def _roots(forms: FloatArray) -> FloatArray:
    """(N, 4), angles q with x^T Q x = 0, x = (cos q, sin q, 1), for quadratic forms Q (N, 3, 3)."""
    c, s = np.cos(OFFSET), np.sin(OFFSET)
    shift = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    in_t = shift @ np.array([[1.0, 0.0, -1.0], [0.0, 2.0, 0.0], [1.0, 0.0, 1.0]])  # (1 + t^2) x = in_t (1, t, t^2)
    Q = in_t.T @ forms @ in_t
    least = np.maximum(LEAST * np.abs(Q).max(axis=(1, 2)), np.finfo(float).tiny)
    leading = np.where(np.abs(Q[:, 2, 2]) < least, least, Q[:, 2, 2])
    companion = np.zeros((len(Q), 4, 4))
    companion[:, 1:, :3] = np.eye(3)
    lower = [Q[:, 0, 0], 2.0 * Q[:, 0, 1], 2.0 * Q[:, 0, 2] + Q[:, 1, 1], 2.0 * Q[:, 1, 2]]
    companion[:, :, 3] = -np.stack(lower, axis=1) / leading[:, None]
    t = np.linalg.eigvals(companion)
    real = np.abs(t.imag) < NEARLY * (1.0 + t.real**2)
    return np.where(real, OFFSET + 2.0 * np.arctan(t.real), np.nan)
