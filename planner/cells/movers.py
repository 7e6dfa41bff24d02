"""Machines and objects that move on known trajectories, in the world and on one clock."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from planner.certificate.clearance import parts_of, segment_checkers
from planner.errors import InvalidProblem
from planner.fields import FieldPath
from planner.plans.result import Plan
from planner.robots import Robot
from planner.scene.checker import CollisionChecker, checker_of, displacements_by_following
from planner.scene.motions import Leg
from planner.scene.phases import Phase, moved_bodies
from planner.scene.scene import HERE, Scene, SceneObject
from planner.shapes import Shape
from planner.spatial import FloatArray, Pose, as_pose
from planner.trajectories.polynomials import PiecewisePolynomial, joined
from planner.trajectories.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Mover:
    """A robot or an object on a known trajectory in the world.

    It rests before its trajectory starts and after it ends.

    Examples:
        >>> import planner
        >>> box = [planner.Box([0.2, 0.2, 0.2])]
        >>> part = planner.Mover.sliding("part", box, planner.Pose([1.0, -1.0, 0.4]), [0.0, 0.25, 0.0], 8.0)
        >>> part.duration
        8.0

    Attributes:
        name: The name that checks and refusals use.
        phases: Its bodies and their motions, in order of time.
    """

    name: str
    phases: tuple[Phase, ...]

    @classmethod
    def sliding(
        cls,
        name: str,
        shapes: Sequence[Shape],
        pose: Pose,
        velocity: ArrayLike,
        duration: float,
        start: float = 0.0,
    ) -> Self:
        """Return an object that slides along a straight line at constant velocity, such as a part on a belt.

        Args:
            name: Its name.
            shapes: Its bounded shapes, in its own frame.
            pose: Its pose in the world before it slides.
            velocity: (3,), m/s, in the world.
            duration: The time for which it slides, s.
            start: The time at which it starts, s.

        Raises:
            InvalidProblem: The velocity, the duration or the start is not finite, or a shape is not bounded.
        """
        v, pose = np.array(velocity, dtype=np.float64), as_pose(pose, "pose")
        faults: list[tuple[FieldPath, str]] = []
        if v.shape != (3,) or not np.isfinite(v).all():
            faults.append((("velocity",), "must be three finite numbers"))
        if not 0.0 < duration < np.inf:
            faults.append((("duration",), f"must be positive and finite; got {duration:g}"))
        if not np.isfinite(start):
            faults.append((("start",), "must be finite"))
        for k, shape in enumerate(shapes):
            if shape.bounding_capsule is None:
                faults.append((("shapes", k), "must be bounded; a half space is not"))
        if faults:
            raise InvalidProblem(faults)
        rotation = np.eye(3) if pose.rotation is None else pose.rotation
        bodies, rates = moved_bodies(name, shapes, Leg(0.0, duration, pose.position, rotation, v, np.zeros(3)), None)
        motion = PiecewisePolynomial(np.array([duration]), np.column_stack([np.zeros(len(rates)), rates])[None])
        return cls(name, (Phase(bodies, motion, start, -np.inf, np.inf, np.zeros(len(shapes))),))

    @classmethod
    def of_trajectory(cls, name: str, robot: Robot, trajectory: Trajectory, scene: Scene | None = None) -> Self:
        """Return a robot that runs a trajectory, with the attached objects of a scene; its mounting is its base."""
        given = () if scene is None else scene.objects
        return cls._of(name, [(robot, checker_of(robot, scene, False), trajectory, 0.0)], given)

    @classmethod
    def of_plan(cls, name: str, plan: Plan, handed_over: Collection[str] = ()) -> Self:
        """Return the robot of a plan, with the objects that it carries, takes and puts down.

        Args:
            name: The name that checks and refusals use.
            plan: The plan.
            handed_over: Names of objects that are left out after the robot has put them down.
        """
        checkers = segment_checkers(plan.problem, plan.path.positions)
        given = [] if plan.problem.scene is None else [*plan.problem.scene.objects]
        given += [thing for each in checkers for thing in each.scene.objects if thing.id in handed_over]
        return cls._of(name, [(plan.problem.robot, *part) for part in parts_of(checkers, plan.trajectory)], given)

    @classmethod
    def _of(
        cls,
        name: str,
        parts: Sequence[tuple[Robot, CollisionChecker, PiecewisePolynomial, float]],
        given: Sequence[SceneObject] = (),
    ) -> Self:
        """Return a robot in parts of its trajectory; objects of its scenes that are not given are its own."""
        limits = [-np.inf, *(begin for *_, begin in parts[1:]), np.inf]
        phases = []
        for (robot, checker, motion, start), (begin, end) in zip(parts, pairwise(limits), strict=True):
            bodies = checker.bodies_of_robot(given)
            moved = np.zeros(len(bodies.pieces))
            if robot.following_errors is not None:
                moved = displacements_by_following(bodies, robot).sum(axis=1)
            placed = bodies.placed(robot.mounting or HERE)
            phases.append(Phase(placed, motion, start, begin, end, moved, checker.largest_uncertainty))
        return cls(name, tuple(phases))

    @property
    def duration(self) -> float:
        """When its trajectory ends on the clock, s."""
        return self.phases[-1].stop

    def waiting(self, rests: FloatArray, waits: FloatArray) -> Mover:
        """Return the mover that waits for times (rests,), s, where it rests at times (rests,), s."""
        phases = []
        for phase in self.phases:
            begin, end, start = (
                at + float(waits[rests < at].sum()) if np.isfinite(at) else at
                for at in (phase.begin, phase.end, phase.start)
            )
            among = (rests >= phase.start) & (rests < phase.stop) & (waits > 0.0)
            cuts = [phase.start, *rests[among].tolist(), phase.stop]
            longer = [0.0, *waits[among].tolist()]
            parts = []
            for (low, high), wait in zip(pairwise(cuts), longer, strict=True):
                if wait:
                    parts.append(replace(phase.between(low, low), lengths=np.array([wait])))
                if high > low:
                    parts.append(phase.between(low, high))
            phases.append(replace(phase, motion=joined(parts), start=start, begin=begin, end=end))
        return replace(self, phases=tuple(phases))


@dataclass(frozen=True)
class Rules:
    """What two robots must keep, in any pair of a cell.

    Attributes:
        margin: The least distance, m.
        skew: The largest time by which one of them may start before or after the other, s.
        allowed_pairs: Pairs of names `mover/body` that may touch.
    """

    margin: float = 0.0
    skew: float = 0.0
    allowed_pairs: frozenset[frozenset[str]] = frozenset()

    @classmethod
    def of(cls, margin: float, skew: float, allowed_pairs: Iterable[Sequence[str]]) -> Rules:
        """Return the rules with pairs of names in any order."""
        return cls(margin, skew, frozenset(frozenset(pair) for pair in allowed_pairs))

    def margins(self, movers: tuple[Mover, Mover], phases: tuple[Phase, Phase]) -> FloatArray:
        """Return the margins (first, second) of pairs of bodies with the displacements by following errors, m.

        The margin of a pair that may touch is negative infinity.
        """
        first, second = phases
        margins = self.margin + first.displacements[:, None] + second.displacements
        if self.allowed_pairs:
            names = [
                [f"{mover.name}/{piece.name}" for piece in phase.bodies.pieces]
                for mover, phase in zip(movers, phases, strict=True)
            ]
            allowed = [[frozenset((one, other)) in self.allowed_pairs for other in names[1]] for one in names[0]]
            margins[np.array(allowed, dtype=bool).reshape(margins.shape)] = -np.inf
        return np.asarray(margins)
