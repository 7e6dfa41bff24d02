"""Free motions with an upright tool, by this library and by OMPL's projected planner in the same scenes."""

from __future__ import annotations

import sys
import time
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin

import planner
from benchmarks.collisions.models import Contacts
from benchmarks.collisions.peers import SEED
from benchmarks.collisions.scenes import KINDS, Problem, axis_down, problem
from benchmarks.machine import machine
from planner.errors import PlanningError
from planner.kinematics.forward import tool_pose
from planner.kinematics.inverse import all_solutions
from planner.robots import load_robot

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planner.robots import Robot
    from planner.spatial import FloatArray

ANGLE = 0.2
"""The largest angle between the tool's axis and the vertical, rad."""

CHECKS_PER_SECOND = 1500
"""Motions that the search of this library, which knows no seconds, checks for each second."""

MOST_ATTEMPTS = 20
"""The largest number of attempts at a plan: detours with slower corners, without remedies of long refusals."""

SAMPLES = 10_000
"""Number of samples of each trajectory that are checked by Pinocchio."""

VALIDITY_DELTA = 0.05
"""The step of OMPL's geodesics, rad: its default."""

DOWN = np.array([0.0, 0.0, -1.0])
"""The direction of the axis in the base frame."""


def measure(count: int, arms: Sequence[str], seconds: float) -> dict[str, Any]:
    """Plan so many problems of each kind for each arm in so many seconds, beside OMPL if it is installed."""
    solvers: dict[str, Callable[[Robot, Problem, float], dict[str, Any]]] = {"planner": ours}
    if find_spec("ompl"):
        solvers["ompl"] = theirs
    figures: dict[str, Any] = {}
    for arm in arms:
        robot = load_robot(arm)
        _ = robot.collision_pairs  # which is not prepared for each problem
        asked = [problem(robot, kind, number, is_upright=True) for kind in KINDS for number in range(count)]
        records: dict[str, list[dict[str, Any]]] = {name: [] for name in solvers}
        for one in asked:
            for name, solve in solvers.items():
                records[name].append(solve(robot, one, seconds))
            taken = (
                f"{name} {own[-1]['seconds']:.2f} s{'' if own[-1]['found'] else ' (not found)'}"
                for name, own in records.items()
            )
            print(f"{arm}, {one.kind} {one.number}:", ", ".join(taken), file=sys.stderr, flush=True)
        found_by_any = [any(own[k]["found"] for own in records.values()) for k in range(len(asked))]
        figures[arm] = {
            "problems": len(asked),
            "found_by_any": sum(found_by_any),
            "solvers": {name: _summary(own) for name, own in records.items()},
            "missed": [
                f"{one.kind} {one.number}"
                for one, found, own in zip(asked, found_by_any, records["planner"], strict=True)
                if found and not own["found"]
            ],
        }
    return {"machine": machine(), "seconds": seconds, "angle": ANGLE, "arms": figures}


def ours(robot: Robot, asked: Problem, seconds: float) -> dict[str, Any]:
    """Plan a certified trajectory, and count the samples that tip the tool by Pinocchio's kinematics."""
    axis = axis_down(asked.kind)
    keep = planner.ToolAxis((0.0, 0.0, -1.0), ANGLE, axis)
    motion = planner.FreeMotion(most_checks=int(seconds * CHECKS_PER_SECOND), keep=(keep,))
    waypoints: list[planner.AnyWaypoint] = [
        planner.JointWaypoint(asked.start.tolist()),
        planner.PoseWaypoint(tool_pose(robot, asked.goal), motion=motion),
    ]
    wanted = planner.PlanningProblem(robot, waypoints, scene=asked.scene, self_collision=True)
    begun = time.process_time()
    try:
        trajectory = planner.plan(wanted, budget=planner.Budget(attempts=MOST_ATTEMPTS)).trajectory
    except PlanningError:
        return {"found": False, "seconds": time.process_time() - begun}
    taken = time.process_time() - begun
    positions = trajectory.evaluate(np.linspace(0.0, trajectory.duration, SAMPLES), [0])[0]
    found = {"found": taken <= seconds, "seconds": taken, "duration": trajectory.duration}
    return found | _judged(robot, asked, positions)


def theirs(robot: Robot, asked: Problem, seconds: float) -> dict[str, Any]:
    """Plan with OMPL's RRT-Connect in a projected state space, by the level components of the tool's axis."""
    from ompl import base, geometric, util

    util.setLogLevel(util.LogLevel.LOG_NONE)
    util.RNG.setSeed(SEED + 1)
    axis = np.array(axis_down(asked.kind))
    contacts = Contacts(robot, asked.scene, true_meshes=False)

    class Upright(base.Constraint):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__(robot.dof, 2, float(np.sin(0.95 * ANGLE)))

        def function(self, x: Any, out: Any) -> None:
            out[:] = _rotation(robot, np.asarray(x)).dot(axis)[:2]

        def jacobian(self, x: Any, out: Any) -> None:
            position = np.asarray(x, dtype=np.float64)
            rates = pin.computeFrameJacobian(
                robot.model, robot.data, position, robot.tool_frame_id, pin.LOCAL_WORLD_ALIGNED
            )[3:]
            out[:, :] = -pin.skew(robot.data.oMf[robot.tool_frame_id].rotation @ axis)[:2] @ rates

    inner = base.RealVectorStateSpace(robot.dof)
    bounds = base.RealVectorBounds(robot.dof)
    for k, (low, high) in enumerate(zip(robot.limit("lower"), robot.limit("upper"), strict=True)):
        bounds.setLow(k, max(float(low), -2.0 * np.pi))
        bounds.setHigh(k, min(float(high), 2.0 * np.pi))
    inner.setBounds(bounds)
    constraint = Upright()
    space = base.ProjectedStateSpace(inner, constraint)
    space.setDelta(VALIDITY_DELTA)
    information = base.ConstrainedSpaceInformation(space)
    setup = geometric.SimpleSetup(information)
    setup.setStateValidityChecker(lambda state: not contacts.touches(np.array([state[k] for k in range(robot.dof)])))
    start = space.allocState()
    start.copy(asked.start)
    setup.addStartState(start)
    goals = base.GoalStates(information)
    for solution in all_solutions(robot, tool_pose(robot, asked.goal)):
        if not contacts.touches(np.array(solution)):
            goal = space.allocState()
            goal.copy(np.array(solution))
            goals.addState(goal)
    setup.setGoal(goals)
    setup.setPlanner(geometric.RRTConnect(information))
    begun = time.process_time()
    is_over = base.PlannerTerminationCondition(lambda: time.process_time() - begun > seconds)
    found = bool(setup.solve(is_over)) and setup.haveExactSolutionPath()
    taken = time.process_time() - begun
    if not found:
        return {"found": False, "seconds": taken}
    path = setup.getSolutionPath()
    path.interpolate()
    positions = np.array([[state[k] for k in range(robot.dof)] for state in path.getStates()])
    return {"found": True, "seconds": taken} | _judged(robot, asked, positions)


def _judged(robot: Robot, asked: Problem, positions: FloatArray) -> dict[str, Any]:
    """Count the positions (N, joints) of a path that tip the tool or are beyond the joints' limits.

    Return its length, and whether it touches, too.
    """
    axis, judge = axis_down(asked.kind), Contacts(robot, asked.scene, true_meshes=False)
    beyond = (positions < robot.limit("lower") - 1e-6) | (positions > robot.limit("upper") + 1e-6)
    return {
        "beyond": int(beyond.any(axis=1).sum()),
        "tipped": sum(_tilt(robot, position, axis) > ANGLE + 1e-6 for position in positions),
        "touches": judge.touches_along(positions),
        "length": float(np.linalg.norm(np.diff(positions, axis=0), axis=1).sum()),
    }


def _rotation(robot: Robot, position: FloatArray) -> FloatArray:
    """Return the rotation (3, 3) of the tool by Pinocchio."""
    pin.framesForwardKinematics(robot.model, robot.data, position)
    return np.array(robot.data.oMf[robot.tool_frame_id].rotation)


def _tilt(robot: Robot, position: FloatArray, axis: tuple[float, float, float]) -> float:
    """Return the angle, rad, between the tool's axis and the vertical."""
    turned = _rotation(robot, position) @ np.array(axis)
    return float(np.arctan2(np.linalg.norm(np.cross(turned, DOWN)), turned @ DOWN))


def _summary(records: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the figures of one planner."""
    found = [record for record in records if record["found"]]
    figures: dict[str, Any] = {"found": len(found)}
    if found:
        times = [record["seconds"] for record in found]
        figures |= {"p50": float(np.median(times)), "p95": float(np.quantile(times, 0.95))}
    for name in ("tipped", "touches", "beyond"):
        if found and name in found[0]:
            figures[name] = int(sum(record[name] for record in found))
    for name in ("duration", "length"):
        if found and name in found[0]:
            figures[name] = float(np.median([record[name] for record in found]))
    return figures


def print_table(figures: dict[str, Any]) -> None:
    """Print the figures for a person."""
    print(f"upright tool within {figures['angle']} rad, {figures['seconds']:g} s")
    for arm, own in figures["arms"].items():
        print(f"\n{arm}: {own['problems']} problems, {own['found_by_any']} found by any")
        for name, values in own["solvers"].items():
            print(f"  {name:8}", ", ".join(f"{key} {value:.3g}" for key, value in values.items()))
        print("  missed by the planner:", ", ".join(own["missed"]) or "none")
