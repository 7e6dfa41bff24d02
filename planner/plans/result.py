"""A certified plan, and the one function that makes one: parametrize the path, certify, refuse or return."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from planner.backends.base import BackEnd
from planner.backends.shared.assembly import assemble
from planner.certificate.checks import Certificate, Check
from planner.certificate.clearance import (
    CLEARANCE_TOLERANCE,
    certify_clearance_along,
    segment_checkers,
)
from planner.certificate.durations import certify_durations
from planner.certificate.joint_motions import certify_joint_motions
from planner.certificate.limits import certificate_of, unless_missed
from planner.certificate.pose_constraints import certify_pose_constraints
from planner.certificate.residual_vibration import certify_residual_vibration
from planner.certificate.rides import certify_rides
from planner.certificate.sampling import SampleCertificate, certify_sampling
from planner.certificate.speed_zones import SpeedZoneCheck, certify_speed_zones, refuse_too_fast
from planner.certificate.tool_path import certify_tool_path
from planner.certificate.waypoints import MetWaypoints, certify_passages, certify_waypoints
from planner.choices import Choice
from planner.errors import InfeasibleDuration, InvalidProblem, LimitsUnsatisfiable, PlanningError, distinct
from planner.fields import BACK_END
from planner.free_motion.detours import Detour
from planner.guarantees import END_OPTIONS, EndStates, end_states, leaves_straight_motions, moves_at_its_ends
from planner.limits import SMALLEST
from planner.paths import JointPath
from planner.plans.binding import with_binding_limits
from planner.plans.optimisation import Optimisation
from planner.plans.ride import RideReport
from planner.plans.saved import read_plan, write_plan
from planner.plans.warnings import plan_warnings
from planner.problems.any_of import requested_indices
from planner.problems.problem import PlanningProblem, ViaWaypoint
from planner.samples import Samples, sample_at
from planner.spatial import FloatArray
from planner.time_scaling.sampled_limits import refuse_what_turns_too_often
from planner.timing.action_times import TimedAction, action_times
from planner.timing.continuous_torque import within_rms_torque
from planner.timing.durations import duration_error, in_requested_durations
from planner.timing.rides import with_rides
from planner.timing.shaping import shaping_time
from planner.timing.slowing import slowed
from planner.tolerances import ROUNDING
from planner.trajectories.trajectory import PlanWarning, Trajectory

if TYPE_CHECKING:  # matplotlib is loaded by the first picture
    from pathlib import Path

    from planner.plots.animation import Animation
    from planner.plots.picture import Picture
    from planner.plots.viewer import Viewer


@dataclass(frozen=True, eq=False)
class Plan:
    """A certified trajectory with its problem and back end. Every enforced limit is kept, or no plan exists.

    Attributes:
        problem: The request: the robot, the waypoints and the limits.
        backend: The back end that computed the time scaling, with its options.
        path: The path of the joints, without time.
        trajectory: The path with time on it.
        certificate: The check of the trajectory against every limit; satisfied.
        warnings: Warnings of the back end and of the planner, such as requested limits that are not enforced.
        detours: The collision-free paths found for the requested free motions. In `problem`, joint motions along these
            paths replace the free motions.
        choices: The choice at each goal set of the request. In `problem`, the chosen options replace the goal sets.
        optimisation: The gain of the requested optimisation of the duration. In `problem`, the moved waypoints are at
            their joint positions. None: not requested.
        rides: The times of the rides on moving objects. In `problem`, joint positions replace their waypoints.
    """

    problem: PlanningProblem
    backend: BackEnd
    path: JointPath
    trajectory: Trajectory
    certificate: Certificate
    warnings: tuple[PlanWarning, ...]
    detours: tuple[Detour, ...] = ()
    choices: tuple[Choice, ...] = ()
    optimisation: Optimisation | None = None
    rides: tuple[RideReport, ...] = ()

    def __repr__(self) -> str:
        """Return robot, back end and duration, in one line."""
        robot, waypoints = self.problem.robot.id, len(self.problem.waypoints)
        return f"Plan({robot!r}, {self.backend.kind}, {waypoints} waypoints, {self.trajectory.duration:.6g} s)"

    @property
    def requested_indices(self) -> tuple[int, ...]:
        """The index in the request of each waypoint; corners of a detour have that of the waypoint it leads to."""
        return requested_indices(self.problem)

    @cached_property
    def actions(self) -> tuple[TimedAction, ...]:
        """Actions besides motion, with their times."""
        return action_times(self.path.dynamics, self.trajectory, self.problem.actions)

    def samples(self, period: float = 0.01, include: Collection[str] = ()) -> Samples:
        """Evaluate the trajectory at multiples of a period, s, and at its end.

        Args:
            period: Time between samples, s.
            include: Further quantities, some of `planner.INCLUDABLE`.

        Raises:
            MissingDynamics: Torques are included, and the robot has neither inertias nor a payload.
        """
        times = self.trajectory.sample_times(period)
        return sample_at(self.path.dynamics, self.trajectory, times, include)

    def certify_samples(self, times: FloatArray) -> list[SampleCertificate]:
        """Check each interpolation of samples that a controller may run against the limits of the plan.

        Args:
            times: Times of the samples (N,), s, strictly increasing from 0 to the duration.
        """
        ends = end_states(self.backend, self.path.robot.dof)
        return certify_sampling(self.path.dynamics, self.trajectory, self.path.limits, times, ends)

    def plot(
        self,
        *show: str,
        joints: Collection[str] | None = None,
        axes: Collection[str] | None = None,
        view: str = "isometric",
        title: str | None = None,
    ) -> Picture:
        """Draw graphs over time, the path of the tool, or the robot at the waypoints, one below the other.

        Args:
            show: Names of the graphs and views, see `planner.draw_plan`; omitted: positions, velocities and
                accelerations.
            joints: Names of the joints of the graphs; None: all.
            axes: Axes of the graphs, of `x`, `y` and `z`; None: all.
            view: Viewpoint: `isometric`, or onto the plane `xy`, `xz` or `yz` of the base.
            title: The title; None: the robot's id.

        Raises:
            InvalidProblem: The robot has no joint of such a name.
            MissingDynamics: `show` has torques, and the robot has neither inertias nor a payload.
            ValueError: `show` has an unknown name.
        """
        from planner.plots.picture import draw_plan

        return draw_plan(self, show or None, joints=joints, axes=axes, view=view, title=title)

    def animate(self, *, view: str = "isometric", speed: float = 1.0) -> Animation:
        """Let the stick model of the robot move along the trajectory in its scene; notebooks and browsers play it.

        Args:
            view: Where it is looked at from: `isometric`, or onto the plane `xy`, `xz` or `yz` of the base.
            speed: How many seconds of the trajectory pass in one.

        Raises:
            ValueError: There is no such view, or the speed is not a positive number.
        """
        from planner.plots.animation import animate

        return animate(self, view=view, speed=speed)

    def view(self, *, port: int = 8080) -> Viewer:
        """Show the robot in its scene, with the path of its tool, in a browser on this machine.

        Args:
            port: The port of the viewer's address; if another program has it, the next free one.

        Returns:
            The viewer, which serves its `url` until `close`. A notebook shows it.

        Raises:
            ModuleNotFoundError: viser is not installed (extra `view`).
        """
        from planner.plots.viewer import Viewer

        return Viewer(self, port)

    def save(self, path: str | Path) -> None:
        """Write the plan with everything that it has to a file, for `planner.load`.

        Args:
            path: The path of the file; one that exists is replaced.

        Raises:
            TypeError: The problem has a value that is not of the library, such as a constraint or back end of your own.
        """
        write_plan(self, path)

    def _repr_html_(self) -> str:
        """Return the plan at a glance, for notebooks."""
        from planner.plots.summary import summary

        return summary(self)


def load(path: str | Path) -> Plan:
    """Read a plan that `Plan.save` wrote.

    Nothing is planned or certified again: the plan is the saved one, to the last bit. No code in the file is run. A
    digest shows whether the file is damaged, not who wrote it: `write_proof` proves the claims of a plan again.

    Args:
        path: The path of the file.

    Raises:
        ValueError: The file is no saved plan, is damaged, or is of another version.
    """
    plan = read_plan(path)
    if not isinstance(plan, Plan):
        raise ValueError(f"{path} has a {type(plan).__name__}, no plan")
    return plan


def timed(problem: PlanningProblem, backend: BackEnd, path: JointPath) -> Trajectory:
    """Compute the trajectory on the path of a problem, not shaped and without a certificate.

    A requested duration of the whole leaves time for shaping.

    Raises:
        InvalidProblem: The request has motion at the ends, but all waypoints are at one joint position.
        InvalidProblem: A joint travels too far for limits of torque or of the tool to be checked.
        InfeasibleDuration: A duration, of a segment or of the whole, is shorter than the limits allow.
        PlanningError: Another refusal of the back end.
    """
    extra = shaping_time(problem.residual_vibration, path)
    if problem.duration is None or not extra:
        return _timed(problem, backend, path)
    try:
        return _timed(replace(problem, duration=max(problem.duration - extra, SMALLEST)), backend, path)
    except InfeasibleDuration as refusal:
        raise duration_error(problem.duration, (refusal.limit or 0.0) + extra) from None
    except PlanningError as refusal:
        whole = [remedy for remedy in refusal.remedies if remedy.field == ("duration",)]
        longer = [replace(remedy, value=remedy.value + extra) for remedy in whole]
        raise refusal.with_remedies([*longer, *(own for own in refusal.remedies if own not in whole)]) from None


def _timed(problem: PlanningProblem, backend: BackEnd, path: JointPath) -> Trajectory:
    """Compute the trajectory on the path of a problem in its durations."""
    refuse_what_turns_too_often(path)
    trajectory = in_requested_durations(problem, backend, path) if len(path.moving) else _rest(path, backend)
    trajectory = within_rms_torque(problem, backend, path, slowed(problem, backend, path, trajectory))
    if problem.duration is not None and abs(trajectory.duration - problem.duration) > ROUNDING * problem.duration:
        raise duration_error(problem.duration, trajectory.duration)
    return with_rides(path, trajectory)


def certified(
    problem: PlanningProblem,
    backend: BackEnd,
    path: JointPath,
    trajectory: Trajectory,
    unshaped: Trajectory | None = None,
) -> Plan:
    """Certify a trajectory that `timed` computed for the same problem, back end and path.

    Args:
        problem: The problem.
        backend: The back end.
        path: The path.
        trajectory: The trajectory, shaped if the problem requests it.
        unshaped: The trajectory before it was shaped; None: it was not shaped.

    Raises:
        InvalidProblem: The request has an action after the end of the trajectory.
        Collision: The robot would come closer to itself or to an object than the margin allows.
        ClearanceUnproved: The planner could not prove the clearance.
        LimitsUnsatisfiable: The trajectory breaks a limit that the back end enforces.
    """
    near = [k for group in path.groups for k in group.blended]
    if unshaped is not None and unshaped is not trajectory:
        passed = (k for group in path.groups for k in group.segments[1:].tolist())
        near += [k for k in passed if isinstance(problem.waypoints[k], ViaWaypoint)]  # shaped motions cut these corners
    met = certify_waypoints(trajectory, problem, path.positions, near)
    certificate = _certificate(problem, backend, path, trajectory, met, near, unshaped or trajectory)
    refuse_unless_satisfied(certificate)
    clearance = None
    if problem.scene is not None or problem.self_collision:
        tolerance = None if problem.scene is None else CLEARANCE_TOLERANCE  # the margins alone are proved faster
        checkers = segment_checkers(problem, path.positions)
        given = () if problem.scene is None else problem.scene.objects
        clearance = certify_clearance_along(checkers, trajectory, tolerance, given)
    speed_zones = _speed_zones(problem, path, trajectory)
    certificate = with_binding_limits(certificate, problem, trajectory)
    certificate = replace(certificate, clearance=clearance, speed_zones=speed_zones)
    warnings = tuple(plan_warnings(problem, backend, path, trajectory, certificate))
    waypoints = tuple(
        waypoint
        if error == (waypoint.position_error, waypoint.orientation_error)
        else replace(waypoint, position_error=error[0], orientation_error=error[1])
        for waypoint, error in zip(path.waypoints, met.errors, strict=True)
    )
    path = path if waypoints == path.waypoints else replace(path, waypoints=waypoints)
    made = Plan(problem, backend, path, trajectory, certificate, warnings)
    _ = made.actions  # refused here where one is after the end
    return made


def _speed_zones(problem: PlanningProblem, path: JointPath, trajectory: Trajectory) -> tuple[SpeedZoneCheck, ...]:
    """Prove that no point of the robot is too fast near objects.

    Raises:
        LimitsUnsatisfiable: One is.
    """
    if not problem.speed_zones:
        return ()
    robots = [path.dynamics.robot_on(segment) for segment in range(max(1, len(path.durations)))]
    checks = certify_speed_zones(problem.speed_zones, segment_checkers(problem, path.positions), robots, trajectory)
    refuse_too_fast(checks)
    return checks


def _rest(path: JointPath, backend: BackEnd) -> Trajectory:
    """Return the trajectory where nothing moves, which no back end has to put time on."""
    if moves_at_its_ends(backend):
        moving = [name for name in END_OPTIONS if any(getattr(backend, name) or ())]
        if moving:
            message = "all waypoints are one joint position: the robot rests there"
            raise InvalidProblem([((BACK_END, name), message) for name in moving])
    return assemble(path, [])


def _certificate(
    problem: PlanningProblem,
    backend: BackEnd,
    path: JointPath,
    trajectory: Trajectory,
    met: MetWaypoints,
    near: Sequence[int],
    unshaped: Trajectory,
) -> Certificate:
    wanted = np.where(np.isnan(met.positions), path.positions, met.positions)
    wanted[near] = np.nan
    checks = certify_tool_path(trajectory, problem.robots, problem.waypoints, path.waypoints, met.targets)
    checks += certify_rides(trajectory, problem)
    checks += certify_pose_constraints(trajectory, problem.robots, problem.waypoints)
    checks += [*certify_passages(trajectory, path.robot.joint_names, path.passed_at), *met.checks]
    checks += certify_durations(trajectory, problem.waypoints, problem.duration)
    if leaves_straight_motions(backend):
        checks += certify_joint_motions(trajectory, path.dynamics, problem.waypoints, path.positions, backend)
    ends = end_states(backend, path.robot.dof)
    checks += _residual_vibration(problem, path, trajectory, unshaped, ends)
    return unless_missed(
        certificate_of(trajectory, path.robot, path.limits, backend.guarantees, wanted, checks, ends, path.dynamics)
    )


def _residual_vibration(
    problem: PlanningProblem, path: JointPath, trajectory: Trajectory, unshaped: Trajectory, ends: EndStates
) -> list[Check]:
    """Return the check of residual vibration, if a mode is requested."""
    mode = problem.residual_vibration
    if mode is None or not len(path.moving):
        return []
    rows = path.rows_of_groups(trajectory)
    motions = [trajectory.of(own) for own in rows]
    times = trajectory.breakpoints[[own[-1] + 1 for own in rows]]
    before = [unshaped.of(own) for own in path.rows_of_groups(unshaped)] if mode.suppress else None
    around = ends.initial_velocity, ends.final_velocity
    return certify_residual_vibration(mode, path.robot.joint_names, motions, times, around, before)


def refuse_unless_satisfied(certificate: Certificate) -> None:
    """Keep the promise: no trajectory that breaks an enforced limit goes out.

    Raises:
        LimitsUnsatisfiable: Naming the worst check.
    """
    if certificate.satisfied:
        return
    broken = [check for check in certificate.checks if check.enforced and not check.satisfied]
    if not broken:
        missed = f"a joint would miss its waypoint by {certificate.waypoint_error:.4g} rad or m"
        raise LimitsUnsatisfiable(missed, value=certificate.waypoint_error)
    worst = max(broken, key=lambda check: check.ratio or float("inf"))
    name = worst.quantity.replace("_", " ") + (f" of {worst.joint}" if worst.joint else "")
    peak, limit = distinct(worst.peak, float("inf") if worst.limit is None else worst.limit)
    raise LimitsUnsatisfiable(
        f"the {name} would reach {peak}, its limit is {limit}",
        joint=worst.joint,
        value=worst.peak,
        limit=worst.limit,
        time=worst.time,
    )
