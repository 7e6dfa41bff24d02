"""The other libraries of the benchmark of trajectories, each used as its documentation shows it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline, interp1d

from benchmarks.plain_urdf import plain_urdf

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.spatial import FloatArray

Sampler = Callable[["FloatArray"], "tuple[FloatArray, FloatArray, FloatArray]"]
"""Times (N,) to positions, velocities and accelerations, each (N, joints)."""

GRID = 100
"""Intervals of the grid that toppra is given."""

DENSE = 5
"""Points on each segment for a library that joins its points by straight lines. Tesseract takes 1 s with 5 of them on
40 segments, and is not back after a minute with 20."""

FINE = 10_000
"""Points of a motion that a library hands out as a table; the limits are looked at there."""


@dataclass(frozen=True, eq=False)
class Motion:
    """The answer of a solver.

    Attributes:
        duration: s.
        sample: Any times within it.
    """

    duration: float
    sample: Sampler


Solver = Callable[["FloatArray"], Motion | None]
"""Waypoints (N, joints) to the motion through them, from rest to rest; None: refused, or failed."""


@dataclass(frozen=True)
class Peer:
    """A library beside ours.

    Attributes:
        module: Where it is; the peer is left out where that cannot be imported.
        make: Its solver for a robot, with the robot's own limits.
        stops: Whether it rests at every waypoint; otherwise it passes them.
        promises: Quantities that it is given a limit on.
    """

    module: str
    make: Callable[[Robot], Solver]
    stops: bool = False
    promises: tuple[str, ...] = ("velocity", "acceleration")

    def solver(self, robot: Robot) -> Solver:
        """Return its solver for a robot; an error of the library is a refusal."""
        solve = self.make(robot)

        def answer(positions: FloatArray) -> Motion | None:
            try:
                return solve(positions)
            except (RuntimeError, ValueError):
                return None

        return answer

    @property
    def installed(self) -> bool:
        """Whether it is there."""
        try:
            return find_spec(self.module) is not None
        except ModuleNotFoundError:
            return False


def _ruckig(robot: Robot) -> Solver:
    from ruckig import InputParameter, Result, Ruckig, Trajectory

    def solve(positions: FloatArray) -> Motion | None:
        parts, otg, asked = [], Ruckig(robot.dof), InputParameter(robot.dof)
        asked.max_velocity, asked.max_acceleration, asked.max_jerk = (
            robot.limit(quantity).tolist() for quantity in ("velocity", "acceleration", "jerk")
        )
        for start, end in zip(positions[:-1].tolist(), positions[1:].tolist(), strict=True):
            asked.current_position, asked.target_position = start, end
            part = Trajectory(robot.dof)
            if otg.calculate(asked, part) not in (Result.Working, Result.Finished):
                return None
            parts.append(part)
        starts = np.concatenate([[0.0], np.cumsum([part.duration for part in parts])])

        def sample(times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
            rows = np.searchsorted(starts[1:-1], times, side="right")
            states = [parts[k].at_time(max(t - starts[k], 0.0))[:3] for k, t in zip(rows, times.tolist(), strict=True)]
            q, dq, ddq = np.array(states).transpose(1, 0, 2)
            return q, dq, ddq

        return Motion(float(starts[-1]), sample)

    return solve


def _toppra(parametrizer: str) -> Callable[[Robot], Solver]:
    def make(robot: Robot) -> Solver:
        import toppra
        from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

        toppra.setup_logging("ERROR")
        velocity, acceleration = robot.limit("velocity"), robot.limit("acceleration")
        kept = [JointVelocityConstraint(velocity), JointAccelerationConstraint(acceleration)]

        def solve(positions: FloatArray) -> Motion | None:
            path = toppra.SplineInterpolator(np.linspace(0.0, 1.0, len(positions)), positions)
            grid = np.linspace(0.0, 1.0, GRID + 1)
            law = toppra.algorithm.TOPPRA(kept, path, gridpoints=grid, parametrizer=parametrizer).compute_trajectory()
            return None if law is None else Motion(float(law.duration), lambda t: (law(t), law(t, 1), law(t, 2)))

        return solve

    return make


def _drake(robot: Robot) -> Solver:
    from pydrake.multibody.optimization import CalcGridPointsOptions, Toppra
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import PrismaticJoint, RevoluteJoint, SpatialInertia
    from pydrake.trajectories import PiecewisePolynomial

    # Joint limits ask nothing of the kinematics: a chain with as many joints will do.
    plant, frame = MultibodyPlant(0.0), None
    for i, is_angle in enumerate(robot.is_angle):
        body = plant.AddRigidBody(f"link_{i}", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        kind = RevoluteJoint if is_angle else PrismaticJoint
        parent = plant.world_frame() if frame is None else frame
        plant.AddJoint(kind(f"joint_{i}", parent, body.body_frame(), np.array([0.0, 0.0, 1.0])))
        frame = body.body_frame()
    plant.Finalize()
    velocity, acceleration = robot.limit("velocity"), robot.limit("acceleration")

    def solve(positions: FloatArray) -> Motion | None:
        breaks = np.arange(float(len(positions)))
        if len(positions) > 2:
            path = PiecewisePolynomial.CubicWithContinuousSecondDerivatives(breaks, positions.T, False)
        else:
            path = PiecewisePolynomial.FirstOrderHold(breaks, positions.T)
        problem = Toppra(path, plant, Toppra.CalcGridPoints(path, CalcGridPointsOptions()))
        problem.AddJointVelocityLimit(-velocity, velocity)
        problem.AddJointAccelerationLimit(-acceleration, acceleration)
        law = problem.SolvePathParameterization()
        if law is None:
            return None
        paths, laws = ([curve, curve.derivative(1), curve.derivative(2)] for curve in (path, law))

        def sample(times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
            s, ds, dds = (curve.vector_values(times).T for curve in laws)
            q, dq, ddq = (curve.vector_values(s[:, 0]).T for curve in paths)
            return q, dq * ds, ddq * ds**2 + dq * dds

        return Motion(law.end_time(), sample)

    return solve


def _roboplan(robot: Robot) -> Solver:
    from roboplan.core import JointPath, Scene, loadJointLimitsConfig, loadUrdfSceneDescriptionFromXml
    from roboplan.toppra import PathParameterizerTOPPRA, SplineFittingMode, TOPPRAOptions

    scene = Scene(robot.id, loadUrdfSceneDescriptionFromXml(plain_urdf(robot)))
    lines = ["joint_limits:"]
    for i, joint in enumerate(robot.joints):
        lines += [f"  joint_{i + 1}:", f"    max_velocity: [{joint.velocity}]"]
        lines += [f"    max_acceleration: [{joint.acceleration}]"]
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        file.write("\n".join(lines))
        file.flush()
        scene.importJointLimitsFromConfig(loadJointLimitsConfig(file.name))
    timer, passing = PathParameterizerTOPPRA(scene), SplineFittingMode.Cubic

    def solve(positions: FloatArray) -> Motion | None:
        path = JointPath()
        path.joint_names, path.positions = scene.getJointNames(), list(positions)
        duration = timer.generate(path, TOPPRAOptions(mode=passing)).times[-1]

        @cache
        def table() -> tuple[CubicHermiteSpline, FloatArray, FloatArray, FloatArray]:
            fine = timer.generate(path, TOPPRAOptions(dt=duration / FINE, mode=passing))
            times, q, dq, ddq = (
                np.array(column) for column in (fine.times, fine.positions, fine.velocities, fine.accelerations)
            )
            times, first = np.unique(times, return_index=True)
            return CubicHermiteSpline(times, q[first], dq[first]), times, dq[first], ddq[first]

        def sample(at: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
            q, times, dq, ddq = table()
            at = np.minimum(at, times[-1])  # the fine table may end a rounding error earlier
            return q(at), interp1d(times, dq, axis=0)(at), interp1d(times, ddq, axis=0)(at)

        return Motion(duration, sample)

    return solve


def _tesseract(robot: Robot) -> Solver:
    from tesseract_robotics import tesseract_command_language as language
    from tesseract_robotics import tesseract_time_parameterization as timing

    names = list(robot.joint_names)
    limits = [
        np.column_stack([-robot.limit(quantity), robot.limit(quantity)])
        for quantity in ("velocity", "acceleration", "jerk")
    ]

    def solve(positions: FloatArray) -> Motion | None:
        knots = np.linspace(0.0, 1.0, len(positions))
        points = CubicSpline(knots, positions)(np.linspace(0.0, 1.0, DENSE * (len(positions) - 1) + 1))
        program = language.CompositeInstruction()
        for point in points:
            waypoint = language.StateWaypointPoly_wrap_StateWaypoint(language.StateWaypoint(names, point))
            move = language.MoveInstruction(waypoint, language.MoveInstructionType_FREESPACE)
            program.appendMoveInstruction(language.MoveInstructionPoly_wrap_MoveInstruction(move))
        if not timing.TimeOptimalTrajectoryGeneration().compute(timing.InstructionsTrajectory(program), *limits):
            return None
        rows = []
        for i in range(len(program)):
            # What these hand out lives only as long as what it was taken from.
            instruction = program[i]
            move = language.InstructionPoly_as_MoveInstructionPoly(instruction)
            waypoint = move.getWaypoint()
            state = language.WaypointPoly_as_StateWaypointPoly(waypoint)
            rows.append([state.getTime(), *np.ravel(state.getPosition()), *np.ravel(state.getVelocity())])
        table = np.array(rows)
        times, q, dq = table[:, 0], table[:, 1 : robot.dof + 1], table[:, robot.dof + 1 :]
        if not (np.isfinite(table).all() and (np.diff(times) > 0.0).all()):
            return None
        curve = CubicHermiteSpline(times, q, dq)
        return Motion(float(times[-1]), lambda at: (curve(at), curve(at, 1), curve(at, 2)))

    return solve


PEERS = {
    "Ruckig, stopping": Peer("ruckig", _ruckig, True, ("velocity", "acceleration", "jerk")),
    "toppra, spline": Peer("toppra", _toppra("ParametrizeSpline")),
    "toppra, const. accel.": Peer("toppra", _toppra("ParametrizeConstAccel")),
    "Drake, Toppra": Peer("pydrake", _drake),
    "roboplan, cubic": Peer("roboplan.toppra", _roboplan),
    "tesseract, dense spline": Peer("tesseract_robotics", _tesseract),
}
"""By name. Tesseract joins its points by straight lines with rounded corners, and returns states at the points. It gets
toppra's spline as a dense list, and its states are joined by cubics."""
