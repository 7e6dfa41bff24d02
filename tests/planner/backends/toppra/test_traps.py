"""Traps of the plain toppra library (0.6.10), each with its input, and the answer of the back end."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from toppra.algorithm import TOPPRA

from planner.backends import Toppra
from planner.backends.toppra.intervals import cut
from planner.backends.toppra.profile import fastest_on
from planner.errors import InfeasibleDuration, InvalidProblem, LimitsUnsatisfiable
from planner.limits import Limits
from planner.paths import solve_path
from planner.planning import plan
from planner.problems.transitions import StopTransition
from planner.robots import load_robot
from tests.locations import ROOT
from tests.planner.backends.toppra.toppra_problems import (
    KUKA,
    KUKA_START,
    joint_problem,
    robot_limits,
    through,
    tool_problem,
    worst_ratio,
)


@pytest.mark.large_only
def test_trap_accelerations_are_kept_where_the_plain_library_breaks_them() -> None:
    """Trap 1: on 100 gridpoints its spline exceeds the acceleration limit. The test has a process of its own."""
    code = """
import json, sys
import numpy as np
import toppra
from toppra.algorithm import TOPPRA
from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint
s, positions, velocity, acceleration = (np.array(value) for value in json.load(sys.stdin))
limits = [np.column_stack([-bound, bound]) for bound in (velocity, acceleration)]
path = toppra.SplineInterpolator(s, positions, "natural")
constraints = [JointVelocityConstraint(limits[0]), JointAccelerationConstraint(limits[1])]
law = TOPPRA(constraints, path, gridpoints=np.linspace(0, s[-1], 100)).compute_trajectory()
times = np.linspace(0, law.duration, 10000)
print((np.abs(law(times, 2)) / acceleration).max())
"""
    problem = through("ngv_refuelling_arm", 1, 6)
    positions = np.array([waypoint.position for waypoint in problem.waypoints])
    chords = (np.abs(np.diff(positions, axis=0)) / problem.robot.limit("velocity")).max(axis=1)
    values = [np.concatenate([[0.0], np.cumsum(chords)]), positions]
    values += [problem.robot.limit("velocity"), problem.robot.limit("acceleration")]
    given = json.dumps([value.tolist() for value in values])
    command = [sys.executable, "-W", "ignore", "-c", code]
    plain = subprocess.run(command, input=given, capture_output=True, text=True, check=True, cwd=ROOT)
    assert float(plain.stdout) > 1.05
    assert worst_ratio(plan(problem, Toppra())) <= 1.0 + 1e-6


def test_trap_no_pause_where_the_path_hardly_moves() -> None:
    """Trap 2: it inserted five seconds wherever the speed is about 0. Here the arm turns back at a waypoint."""
    there, back = [0.0, 0.3, 0.1, 0.0, 0.0, 0.0], [0.5, 0.1, 0.1, 0.2, 0.0, 0.0]
    passing = plan(joint_problem("ngv_refuelling_arm", [there, back, there]), Toppra())
    stopping = plan(joint_problem("ngv_refuelling_arm", [there, back, there], passing=False), Toppra())
    assert passing.trajectory.duration <= 1.005 * stopping.trajectory.duration


@pytest.mark.parametrize("apart", [1e-3, 1e-6, 1e-8])
def test_trap_waypoints_that_are_nearly_the_same(apart: float) -> None:
    """Trap 3: it gave up without a reason."""
    first, middle, last = (np.array(w.position) for w in through("ngv_refuelling_arm", 3, 3, 0.3).waypoints)
    twin = middle + apart * np.array([1.0, -1.0, 0.5, 0.0, 0.3, -0.2])
    result = plan(
        joint_problem("ngv_refuelling_arm", [first.tolist(), middle.tolist(), twin.tolist(), last.tolist()]), Toppra()
    )
    assert worst_ratio(result) <= 1.0 + 1e-6
    three = [first.tolist(), middle.tolist(), last.tolist()]
    stopping = plan(joint_problem("ngv_refuelling_arm", three, passing=False), Toppra())
    assert result.trajectory.duration <= 1.04 * stopping.trajectory.duration


def test_trap_waypoints_that_are_the_same_are_a_rest() -> None:
    """Trap 3: it returned Ok with a duration of 0.2 ms."""
    result = plan(joint_problem("ngv_refuelling_arm", [[0.1] * 6, [0.1] * 6, [0.1] * 6]), Toppra())
    assert result.trajectory.duration == 0.01
    assert (result.trajectory.evaluate(result.trajectory.sample_times(0.001), [0])[0] == 0.1).all()


@pytest.mark.parametrize("factor", [1.0, 1.7, 50.0])
@pytest.mark.parametrize("torque_scale", [None, 0.35])
def test_trap_asked_durations_are_met(factor: float, torque_scale: float | None) -> None:
    """Trap 4: it returned Ok with another duration, twice as long."""
    limits = Limits() if torque_scale is None else robot_limits(load_robot(KUKA), torque_scale)
    problem = joint_problem(KUKA, [list(KUKA_START), [-1.0, -0.6, 0.9, 1.0, -0.5, 1.0]], limits=limits)
    requested = plan(problem, Toppra()).trajectory.duration * factor
    waypoints = (problem.waypoints[0], replace(problem.waypoints[1], duration=requested))
    result = plan(replace(problem, waypoints=waypoints), Toppra())
    assert result.trajectory.duration == pytest.approx(requested, rel=1e-12)
    assert worst_ratio(result) <= 1.0 + 1e-6


@pytest.mark.parametrize("kind", ["straight", "line"])
def test_trap_a_duration_too_short_is_refused_and_the_remedy_works(kind: str) -> None:
    """Trap 4 with too short a duration."""
    problem = tool_problem(StopTransition(), limits=robot_limits(load_robot(KUKA), 0.45))
    if kind == "straight":
        problem = joint_problem(KUKA, [list(KUKA_START), [-1.0, -0.6, 0.9, 1.0, -0.5, 1.0]], limits=problem.limits)
    waypoints = [problem.waypoints[0], replace(problem.waypoints[1], duration=0.01), *problem.waypoints[2:]]
    with pytest.raises(InfeasibleDuration) as refusal:
        plan(replace(problem, waypoints=tuple(waypoints)), Toppra())
    (remedy,) = refusal.value.remedies
    assert remedy.field == ("waypoints", 1, "duration")
    waypoints[1] = replace(waypoints[1], duration=remedy.value)
    result = plan(replace(problem, waypoints=tuple(waypoints)), Toppra())
    assert result.trajectory.arrivals[1] == pytest.approx(remedy.value, rel=1e-9)


def test_a_duration_between_waypoints_passed_is_refused() -> None:
    problem = through("ngv_refuelling_arm", 4, 4, 0.3)
    waypoints = list(problem.waypoints)
    waypoints[2] = replace(waypoints[2], duration=9.0)
    with pytest.raises(InvalidProblem) as refusal:
        plan(replace(problem, waypoints=tuple(waypoints)), Toppra())
    assert [field for field, _ in refusal.value.faults] == [("waypoints", 2, "duration")]


def test_trap_jumps_of_the_acceleration_are_told() -> None:
    """Trap 5: its acceleration jumps without a warning; our certificate says that the jerk is unbounded."""
    certificate = plan(through("ngv_refuelling_arm", 4, 4, 0.3), Toppra()).certificate
    jerk = next(check for check in certificate.checks if check.quantity == "jerk")
    assert certificate.continuity == "C1"
    assert not jerk.bounded
    assert not jerk.enforced


@pytest.mark.parametrize("unit", [1e-3, 100.0])
def test_trap_the_grid_does_not_depend_on_the_unit_of_the_path(unit: float) -> None:
    """Trap 6: the same path over another length had four times the points."""
    path = solve_path(through("ngv_refuelling_arm", 6, 4, 0.5))
    factors = np.ones(len(path.durations))
    durations, counts = [], []
    for curve in (path.groups[0].curve, path.groups[0].curve.stretched(unit)):
        law = fastest_on(path, cut([curve], path.limits.velocity.narrower), factors)
        durations.append(law.times.sum())
        counts.append(len(law.times))
    assert counts[0] == counts[1]
    assert durations[1] == pytest.approx(durations[0], rel=1e-6)


def test_trap_no_overshoot_of_a_position_limit() -> None:
    """Trap 7: a spline through a waypoint at a limit went 0.1 rad beyond it."""
    robot = load_robot("date_sorting_arm")
    lower, upper = np.maximum(robot.limit("lower"), -2.0), np.minimum(robot.limit("upper"), 2.0)
    middle = (lower + upper) / 2.0
    near, at = 0.9 * upper + 0.1 * middle, upper
    positions = [middle, at, near, at, lower]
    result = plan(joint_problem(robot.id, [q.tolist() for q in positions]), Toppra())
    sampled = result.trajectory.evaluate(np.linspace(0.0, result.trajectory.duration, 20_000), [0])[0]
    assert (sampled <= robot.limit("upper") + 1e-9).all()
    assert (sampled >= robot.limit("lower") - 1e-9).all()
    assert worst_ratio(result) <= 1.0 + 1e-6


@pytest.mark.large_only
def test_trap_the_package_is_imported_by_the_first_plan_that_needs_it() -> None:
    """Trap 8: importing it takes a second and 80 MB, 30 of them for matplotlib; a worker's warm-up pays for it."""
    code = """
import sys
from planner.backends import Toppra
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.transitions import ThroughTransition
from planner.robots import load_robot
PACKAGES = {"toppra", "toppra.solverwrapper.cy_seidel_solverwrapper", "scipy", "matplotlib"}
ends = [JointWaypoint(position=(q,) * 6) for q in (0.0, 0.5)]
passed = JointWaypoint(position=(0.3,) * 6, transition=ThroughTransition())
for waypoints in (ends, (ends[0], passed, ends[1])):
    plan(PlanningProblem(load_robot("ngv_refuelling_arm"), tuple(waypoints)), Toppra(solver="package"))
    print(len(PACKAGES & sys.modules.keys()), "matplotlib" in sys.modules)
import toppra.algorithm.algorithm
plots = toppra.algorithm.algorithm.plt.Figure
import matplotlib.pyplot
print(plots is matplotlib.pyplot.Figure)
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert result.stdout.split() == ["0", "False", "3", "False", "True"]


@pytest.mark.parametrize("case", ["through", "tool", "torque"])
def test_the_package_computes_the_profile(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The robot follows the package's result on our gridpoints."""
    problem = {
        "through": through("ngv_refuelling_arm", 6, 4, 0.5),
        "tool": tool_problem(StopTransition()),
        "torque": joint_problem(
            KUKA, [list(KUKA_START), [-1.0, -0.6, 0.9, 1.0, -0.5, 1.0]], limits=robot_limits(load_robot(KUKA), 0.3)
        ),
    }[case]
    path = solve_path(problem)
    groups = path.every_group
    intervals = cut([group.curve for group in groups], path.limits.velocity.narrower)
    ones = np.ones(len(path.durations))
    fast = fastest_on(path, intervals, ones, refinements=0, repairs=0)
    own = TOPPRA.compute_parameterization

    def slower(self: object, *ends: float) -> tuple[np.ndarray, np.ndarray, None]:
        accelerations, speeds, _ = own(self, *ends)
        return accelerations / 4.0, speeds / 2.0, None

    monkeypatch.setattr(TOPPRA, "compute_parameterization", slower)
    slow = fastest_on(path, intervals, ones, refinements=0, repairs=0, solver="package")
    assert slow.x == pytest.approx(fast.x / 4.0, rel=1e-6, abs=1e-6 * fast.x.max())
    assert fastest_on(path, intervals, ones, refinements=0, repairs=0).x.tobytes() == fast.x.tobytes()


def test_gravity_beyond_a_torque_limit_is_refused() -> None:
    problem = joint_problem(KUKA, [list(KUKA_START), [-1.0, -0.6, 0.9, 1.0, -0.5, 1.0]])
    weak = robot_limits(problem.robot, 0.01)
    with pytest.raises(LimitsUnsatisfiable, match="gravity alone"):
        plan(replace(problem, limits=weak), Toppra())
