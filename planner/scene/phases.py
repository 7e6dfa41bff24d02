"""Bodies and their motions in intervals of time: of a robot, and of objects that move by themselves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from planner.scene.bodies import Bodies, Body, JointTree, excursions
from planner.scene.motions import Leg
from planner.scene.scene import SceneObject
from planner.shapes import Shape
from planner.spatial import FloatArray, Pose, rotation_with_z_along
from planner.trajectories.polynomials import PiecewisePolynomial, shifted


@dataclass(frozen=True, eq=False)
class Phase:
    """The bodies of a mover in an interval of time in which they stay the same.

    Before the interval the bodies rest where it begins; after it, where it ends.

    Attributes:
        bodies: The bodies, in the world.
        motion: The motion of their joints, from time 0 on, rad or m.
        start: When the motion starts, s.
        begin: When the phase begins, s; negative infinity: it is the first.
        end: When it ends, s; infinite: it is the last.
        displacements: (bodies,), m, by following errors.
        uncertainty: Largest distance of the machine outside its estimated shapes, m.
    """

    bodies: Bodies
    motion: PiecewisePolynomial
    start: float
    begin: float
    end: float
    displacements: FloatArray
    uncertainty: float = 0.0

    @property
    def stop(self) -> float:
        """When the motion stops, s."""
        return self.start + float(self.motion.breakpoints[-1])

    def between(self, begin: float, end: float) -> PiecewisePolynomial:
        """Return the motion of the joints in an interval of time, s, which may be longer than the phase."""
        whole = float(self.motion.breakpoints[-1])
        low, high = (min(max(at - self.start, 0.0), whole) for at in (begin, end))
        parts = []
        if begin < self.start:
            parts.append(self._rest(0.0, min(end, self.start) - begin))
        if high > low:
            parts.append(self.motion.between(low, high))
        if end > self.stop:
            parts.append(self._rest(whole, end - max(begin, self.stop)))
        if not parts:
            return self._rest(low, 0.0)
        return parts[0].followed_by(*parts[1:])

    def _rest(self, at: float, length: float) -> PiecewisePolynomial:
        (position,) = self.motion.evaluate(np.array([at]), [0])[0]
        return PiecewisePolynomial(np.array([length]), position[None, :, None])

    def within(self, begin: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return joint positions (N, joints) in intervals of time (N,), s, and the largest excursions from there."""
        low, high = (np.clip(at - self.start, 0.0, self.motion.breakpoints[-1]) for at in (begin, end))
        positions = self.motion.evaluate((low + high) / 2.0, [0])[0]
        return positions, excursions(self.motion, low, high, positions)


def side_by_side(first: PiecewisePolynomial, second: PiecewisePolynomial) -> PiecewisePolynomial:
    """Return two curves of one length as one curve of all joints, on common breakpoints."""
    whole = min(first.breakpoints[-1], second.breakpoints[-1])
    inner = np.union1d(first.breakpoints[1:-1], second.breakpoints[1:-1])
    knots = np.concatenate([[0.0], inner[(inner > 0.0) & (inner < whole)], [whole]])
    order = max(first.coefficients.shape[2], second.coefficients.shape[2])
    rows = []
    for curve in (first.padded(order), second.padded(order)):
        pieces, local = curve.locate((knots[:-1] + knots[1:]) / 2.0)
        local = np.maximum(local - np.diff(knots) / 2.0, 0.0)
        rows.append(shifted(curve.coefficients[pieces], local[:, None]))
    return PiecewisePolynomial(np.diff(knots), np.concatenate(rows, axis=1))


def object_phases(thing: SceneObject, base: Pose | None, until: float) -> Iterator[Phase]:
    """Yield the phases of an object that moves, up to a time, s; after it they do not hold.

    Args:
        thing: The object, of bounded shapes.
        base: The frame in which its bodies are; None: the world.
        until: The time, greater than 0.
    """
    shapes = [shape for shape in thing.shapes if isinstance(shape, Shape)]
    for k, leg in enumerate(() if thing.motion is None else thing.motion.legs(thing.pose)):
        if leg.begin >= until:
            return
        bodies, rates = moved_bodies(thing.id, shapes, leg, base)
        lengths = np.array([min(leg.end, until) - leg.begin])
        motion = PiecewisePolynomial(lengths, np.column_stack([np.zeros(len(rates)), rates])[None])
        yield Phase(bodies, motion, leg.begin, leg.begin if k else -np.inf, leg.end, np.zeros(len(shapes)))


def moved_bodies(name: str, shapes: Sequence[Shape], leg: Leg, base: Pose | None) -> tuple[Bodies, FloatArray]:
    """Return the shapes of an object as bodies of joints that slide and turn, and the rates of these joints.

    Args:
        name: The name of the object.
        shapes: Its bounded shapes, in its own frame.
        leg: The constant velocities at which it moves.
        base: The frame of the bodies; None: the world.
    """
    pose = Pose(leg.position, leg.rotation)
    turn = np.eye(3)
    if base is not None:
        pose = pose.to_frame(base)
        turn = np.eye(3) if base.rotation is None else base.rotation.T
    before, origin = np.eye(3), pose.position
    is_angle: list[bool] = []
    turns: list[FloatArray] = []
    shifts: list[FloatArray] = []
    rates: list[float] = []
    for vector, turns_about in ((turn @ leg.velocity, False), (turn @ leg.spin, True)):
        rate = float(np.linalg.norm(vector))
        if rate:
            frame = rotation_with_z_along(vector / rate)
            is_angle.append(turns_about)
            turns.append(before.T @ frame)
            shifts.append(np.zeros(3) if rates else origin)
            rates.append(rate)
            before = frame
    tree = JointTree(
        np.array(is_angle, dtype=bool),
        tuple(range(len(rates))),
        np.reshape(turns, (-1, 3, 3)),
        np.reshape(shifts, (-1, 3)),
    )
    rotation = pose.rotation if pose.rotation is not None else np.eye(3)
    translation = np.zeros(3) if rates else origin
    pieces = [
        Body(name, len(rates), before.T @ rotation if rates else rotation, translation, shape) for shape in shapes
    ]
    return Bodies(tree, pieces), np.array(rates)
