"""What an operation on trajectories returns: a trajectory that keeps the limits of its robot, or a refusal."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from planner.certificate import Certificate, certify
from planner.certificate.clearance import certify_clearance
from planner.certificate.limits import continuity
from planner.certificate.sampling import SampleCertificate, certify_sampling
from planner.certificate.speed_zones import certify_speed_zones, refuse_too_fast
from planner.dynamics import SegmentDynamics
from planner.errors import InvalidProblem, PayloadExceeded
from planner.guarantees import JOINT_DERIVATIVES, QUANTITIES, TCP_ORDERS, EndStates
from planner.limits import Limits, segment_limits
from planner.plans.result import refuse_unless_satisfied
from planner.plans.warnings import following_error_warnings, tolerance_warnings, unchecked_positions
from planner.problems.payload_faults import refuse_payload_above_rating
from planner.robots import Robot
from planner.samples import Samples, sample_at
from planner.scene import CollisionChecker, Scene
from planner.spatial import FloatArray
from planner.speed_zones import SpeedZone, refuse_zone_faults
from planner.tolerances import CONTINUITY_TOLERANCE
from planner.trajectories.extrema import derivatives_on_unit_time
from planner.trajectories.polynomials import differentiate, powers
from planner.trajectories.sampled_peaks import DERIVATIVES
from planner.trajectories.trajectory import PlanWarning, Trajectory

LEAST_CONTINUITY = {"torque": 1} | {
    quantity: order - 1 for quantity, order in (*zip(JOINT_DERIVATIVES, range(4), strict=True), *TCP_ORDERS.items())
}
"""Order of the derivative that has to be continuous for a quantity to be bounded."""


T = TypeVar("T", bound="CertifiedTrajectory")
"""The kind of certified trajectory that goes in and comes out again."""


@dataclass(frozen=True, eq=False)
class JointState:
    """The motion of all joints at one time.

    Attributes:
        position: (joints,), rad or m.
        velocity: (joints,), rad/s or m/s.
        acceleration: (joints,), rad/s^2 or m/s^2.
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True, eq=False)
class CertifiedTrajectory:
    """The result of an operation on trajectories. Every enforced limit is kept, or there is no result.

    Attributes:
        robot: The robot, with its tool and payload.
        trajectory: The resulting trajectory.
        limits: The requested limits besides the robot's.
        certificate: The check of it against every limit; satisfied. The motion before it and after it is its own.
        warnings: Warnings, such as that the trajectory begins or ends in motion.
    """

    robot: Robot
    trajectory: Trajectory
    limits: Limits
    certificate: Certificate
    warnings: tuple[PlanWarning, ...]

    @property
    def initial(self) -> JointState:
        """The state that it begins in."""
        return JointState(*self.trajectory.evaluate(0.0))

    @property
    def final(self) -> JointState:
        """The state that it ends in."""
        return JointState(*self.trajectory.evaluate(self.trajectory.duration))

    def samples(self, times: FloatArray, include: Collection[str] = ()) -> Samples:
        """Evaluate the trajectory at times (N,), s, strictly increasing; `include` is that of `Plan.samples`.

        Raises:
            MissingDynamics: Torques are included, and the robot has neither inertias nor a payload.
        """
        return sample_at(SegmentDynamics.unchanged(self.robot), self.trajectory, times, include)

    def certify_samples(self, times: FloatArray) -> list[SampleCertificate]:
        """Check each interpolation of samples that a controller may run against the limits.

        Args:
            times: Times of the samples (N,), s, strictly increasing from 0 to the duration.

        Raises:
            InvalidProblem: The times are not from 0 to the duration.
        """
        trajectory = self.trajectory
        if times[0] != 0.0 or times[-1] != trajectory.duration:
            raise InvalidProblem([(("times",), f"samples are checked from 0 to the end at {trajectory.duration!r} s")])
        limits = segment_limits(self.robot, self.limits, (None,) * (int(trajectory.segments.max()) + 1))
        dynamics = SegmentDynamics.unchanged(self.robot)
        return certify_sampling(dynamics, trajectory, limits, times, own_ends(trajectory))


def kept_clear(
    done: T, scene: Scene | None, self_collision: bool | None = None, speed_zones: Sequence[SpeedZone] = ()
) -> T:
    """Prove the clearance of an operation's result, and its speeds near objects.

    Args:
        done: The result of the operation.
        scene: The obstacles; None: none.
        self_collision: Whether the arm is checked against itself; see `PlanningProblem.self_collision`.
        speed_zones: Speeds that are allowed near objects of the scene.

    Raises:
        InvalidProblem: The scene names an unknown link or uses a name twice, or a speed zone is invalid.
        Collision: The robot would come closer to itself or to an object than the margin allows.
        ClearanceUnproved: The planner could not prove the clearance.
        LimitsUnsatisfiable: A point of the robot would be too fast in a speed zone.
    """
    refuse_zone_faults(scene, speed_zones)
    if scene is None and not self_collision:
        return done
    checker = CollisionChecker(done.robot, scene, self_collision=self_collision)
    report = certify_clearance(checker, done.trajectory)
    checks = certify_speed_zones(speed_zones, [checker], [done.robot], done.trajectory)
    refuse_too_fast(checks)
    certificate = replace(done.certificate, clearance=report, speed_zones=checks)
    before, after = (tuple(_of_certificate(done.robot, each)) for each in (done.certificate, certificate))
    others = (warning for warning in done.warnings if warning not in before)
    return replace(done, certificate=certificate, warnings=(*others, *after))


def certified(
    robot: Robot,
    trajectory: Trajectory,
    limits: Limits,
    enforced: Collection[str] | None,
    given: Sequence[Trajectory] = (),
    ends: EndStates | None = None,
    *,
    is_stop: bool = False,
) -> CertifiedTrajectory:
    """Certify the result of an operation.

    Args:
        robot: The robot, with its tool and payload.
        trajectory: The resulting trajectory.
        limits: Requested limits besides the robot's.
        enforced: The quantities whose limits are to be kept; None: as far as the trajectories bound them.
        given: The trajectories that the operation started from.
        ends: The motion before and after; None: its own.
        is_stop: Whether it stops a robot that already moves: then a payload above the rating is a warning.

    Raises:
        InvalidProblem: Another number of joints than the robot's, limits wider than the robot's, or a position jumps.
        MissingDynamics: The request limits torques of a robot whose torques are unknown.
        PayloadExceeded: The robot carries more than its rated payload.
        LimitsUnsatisfiable: An enforced limit is broken.
    """
    warnings = [*unchecked_positions(robot)]
    try:
        refuse_payload_above_rating(robot, robot.payload_mass)
    except PayloadExceeded as refusal:
        if not is_stop:
            raise
        warnings.append(PlanWarning("payload_above_rating", str(refusal)))
    kept = bounded_quantities([*given, trajectory]) if enforced is None else enforced
    ends = ends or own_ends(trajectory)
    certificate = certify(robot, trajectory, limits=limits, enforced=kept, ends=ends)
    refuse_unless_satisfied(certificate)
    warnings += [*_of_certificate(robot, certificate), *_end_warnings(robot, ends)]
    return CertifiedTrajectory(robot, trajectory, limits, certificate, tuple(warnings))


def refuse_other_joints(robot: Robot, trajectories: Sequence[Trajectory]) -> None:
    """Refuse trajectories of other numbers of joints than the robot has, before anything is made from them.

    Raises:
        InvalidProblem: Naming each.
    """
    several = len(trajectories) > 1
    faults = [
        (("trajectories", k) if several else ("trajectory",), f"{joints} joints, but {robot.id} has {robot.dof}")
        for k, joints in enumerate(trajectory.coefficients.shape[1] for trajectory in trajectories)
        if joints != robot.dof
    ]
    if faults:
        raise InvalidProblem(faults)


def own_ends(trajectory: Trajectory) -> EndStates:
    """Return the motion at the ends of a trajectory as given end states, without acceleration at rest."""
    (v0, v1), (a0, a1) = trajectory.evaluate(np.array([0.0, trajectory.duration]), [1, 2])
    least = CONTINUITY_TOLERANCE * largest_speed(trajectory)
    (v0, a0), (v1, a1) = (
        (v, a) if np.abs(v).max() > least else (np.zeros_like(v), np.zeros_like(a)) for v, a in ((v0, a0), (v1, a1))
    )
    return EndStates(v0, a0, v1, a1)


def largest_speed(trajectory: Trajectory) -> float:
    """Return an upper bound on the speed of any joint, rad/s or m/s; it is tight for short pieces."""
    rates = differentiate(trajectory.coefficients)
    return float(np.abs(rates * powers(trajectory.lengths[:, None], rates.shape[2])).sum(axis=2).max())


def bounded_quantities(trajectories: Sequence[Trajectory]) -> frozenset[str]:
    """Return the quantities that are bounded in all of some trajectories: a quantity that jumps bounds no derivative.

    Raises:
        InvalidProblem: A position jumps, which no robot can do.
    """
    smooth = min(continuity(derivatives_on_unit_time(each, DERIVATIVES), own_ends(each)) for each in trajectories)
    if smooth < 0:
        raise InvalidProblem([(("trajectory",), "the position of a joint jumps where two pieces meet")])
    return frozenset(quantity for quantity in QUANTITIES if LEAST_CONTINUITY[quantity] <= smooth)


def trajectory_warnings(robot: Robot, certificate: Certificate, ends: EndStates) -> Iterator[PlanWarning]:
    """Yield the warnings of a trajectory of any origin.

    Args:
        robot: The robot, with its tool and payload.
        certificate: The check of the trajectory, with its clearance and speed zones.
        ends: The motion before and after.
    """
    yield from unchecked_positions(robot)
    yield from _of_certificate(robot, certificate)
    yield from _end_warnings(robot, ends)


def _of_certificate(robot: Robot, certificate: Certificate) -> Iterator[PlanWarning]:
    """Yield the warnings of limits and clearances that hold only in part."""
    yield from following_error_warnings(robot, certificate)
    yield from tolerance_warnings(robot, certificate)
    if certificate.clearance is not None:
        yield from certificate.clearance.warnings()


def _end_warnings(robot: Robot, ends: EndStates) -> Iterator[PlanWarning]:
    """Yield warnings of a trajectory that begins or ends in motion."""
    for verb, velocity in (("starts", ends.initial_velocity), ("ends", ends.final_velocity)):
        if velocity.any():
            joint = int(np.abs(velocity).argmax())
            fastest = f"{robot.joint_names[joint]} at {velocity[joint]:.6g} rad/s or m/s"
            yield PlanWarning(f"{verb}_in_motion", f"the trajectory {verb} in motion, {fastest}")
