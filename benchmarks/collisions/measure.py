"""Detours by this library and by others in the same scenes, and times of proofs."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import planner
from benchmarks.collisions.models import Contacts
from benchmarks.collisions.peers import PEERS
from benchmarks.collisions.proofs import measure_proofs
from benchmarks.collisions.scenes import KINDS, problem
from benchmarks.machine import machine
from planner.errors import NoPathFound, PlanningError
from planner.robots import load_robot

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchmarks.collisions.peers import Search
    from benchmarks.collisions.scenes import Problem
    from planner.robots import Robot
    from planner.spatial import FloatArray

ARMS = ("ur5", "panda", "kuka_kr16_2")
"""The robots: two with meshes, and one whose shapes are capsules."""

SECONDS = 5.0
"""The time in which a problem counts as solved, s, by default."""

CHECKS_PER_SECOND = planner.FreeMotion().most_checks / SECONDS
"""How many motions this library's search, which knows no seconds, looks at for each of them."""

OURS = "planner"
"""Name of this library among the figures."""

REST = 1e-3
"""The longest motion of a joint, rad, between samples of a judged trajectory: finer than the samples of paths."""


class Answer(NamedTuple):
    """The result of a planner for a problem.

    Attributes:
        path: (N, joints), joined by straight motions, rad; None: nothing.
        seconds: Processor time.
        duration: s, of the delivered trajectory, or of the path timed by this library; None: not possible.
        no_way: Whether it is proved that there is none.
    """

    path: FloatArray | None
    seconds: float
    duration: float | None = None
    no_way: bool = False


def measure(
    count: int, arms: Sequence[str] = ARMS, kinds: Sequence[str] = tuple(KINDS), seconds: float = SECONDS
) -> dict[str, Any]:
    """Solve so many problems of each kind for each arm in so many seconds, with every planner that is installed."""
    where = machine()
    here = {name: peer for name, peer in PEERS.items() if peer.installed}
    figures = {}
    for arm in arms:
        robot = load_robot(arm)
        _ = robot.collision_pairs  # which is not prepared for each problem
        answers: dict[str, list[tuple[Answer, bool]]] = {name: [] for name in (OURS, *here)}
        asked = [problem(robot, kind, number) for kind in kinds for number in range(count)]
        for one in asked:
            judge = Contacts(robot, one.scene, true_meshes=True)
            for name in answers:
                answer = ours(robot, one, seconds) if name == OURS else theirs(robot, one, here[name].make, seconds)
                touches = answer.path is not None and judge.touches_along(answer.path)
                answers[name].append((answer, touches))
        no_way = [answer.no_way for answer, _ in answers[OURS]]
        figures[arm] = {
            "problems": len(asked),
            "no_way": sum(no_way),
            "unsolved": unsolved(asked, answers, seconds),
            "solvers": {name: summary(found, no_way, seconds) for name, found in answers.items()},
            "proofs": measure_proofs(robot, count),
        }
    absent = [name for name in PEERS if name not in here]
    return {"machine": where, "seconds": seconds, "kinds": list(kinds), "arms": figures, "absent": absent}


def ours(robot: Robot, asked: Problem, seconds: float = SECONDS) -> Answer:
    """Plan a certified free motion; estimated shapes are checked against each other, too, as the peers do."""
    start, goal = asked.start.tolist(), asked.goal.tolist()
    motion = planner.FreeMotion(most_checks=int(seconds * CHECKS_PER_SECOND))
    waypoints = [planner.JointWaypoint(start), planner.JointWaypoint(goal, motion=motion)]
    wanted = planner.PlanningProblem(robot, waypoints, scene=asked.scene, self_collision=True)
    begun = time.process_time()
    try:
        trajectory = planner.plan(wanted).trajectory
    except PlanningError as refusal:
        no_way = isinstance(refusal, NoPathFound) and bool(refusal.enclosed_by)
        return Answer(None, time.process_time() - begun, no_way=no_way)
    taken = time.process_time() - begun
    rough = trajectory.evaluate(np.linspace(0.0, trajectory.duration, 101), [0])[0]
    fine = int(np.abs(np.diff(rough, axis=0)).sum(axis=0).max() / REST) + 2
    path = trajectory.evaluate(np.linspace(0.0, trajectory.duration, fine), [0])[0]
    return Answer(path, taken, trajectory.duration)


def theirs(robot: Robot, asked: Problem, make: Any, seconds: float = SECONDS) -> Answer:
    """Ask a peer, whose preparation of the scene is not counted; an error of the library is a refusal."""
    search: Search = make(robot, asked.scene)
    begun = time.process_time()
    try:
        path = search(asked.start, asked.goal, seconds)
    except RuntimeError:
        path = None
    taken = time.process_time() - begun
    return Answer(path, taken, None if path is None else _timed(robot, path))


def _timed(robot: Robot, path: FloatArray) -> float | None:
    """Return the duration of a smoothly passed path, timed by this library without a proof of clearance."""
    passed = planner.ThroughTransition()
    straight = planner.JointMotion("as_given")
    first, *between, last = path.tolist()
    vias = [planner.JointWaypoint(q, motion=straight, transition=passed) for q in between]
    ends = [planner.JointWaypoint(q, motion=straight) for q in (first, last)]
    wanted = planner.PlanningProblem(robot, [ends[0], *vias, ends[1]])
    try:
        return float(planner.plan(wanted).trajectory.duration)
    except PlanningError:
        return None


def unsolved(
    asked: Sequence[Problem], answers: dict[str, list[tuple[Answer, bool]]], seconds: float
) -> list[dict[str, Any]]:
    """List the problems that this library did not solve in time, and whether a path exists.

    Returns:
        Of each its `kind` and `number`, whether it is proved to have `no_way`, and the peers that found a
        collision-free path (`found_by`). With neither, the question is open.
    """
    found = []
    for row, problem_asked in enumerate(asked):
        answer, _ = answers[OURS][row]
        if answer.path is not None and answer.seconds <= seconds:
            continue
        ways = {name: rows[row] for name, rows in answers.items()}
        by = [name for name, (other, touches) in ways.items() if other.path is not None and not touches]
        found.append(
            {"kind": problem_asked.kind, "number": problem_asked.number, "no_way": answer.no_way, "found_by": by}
        )
    return found


def summary(found: Sequence[tuple[Answer, bool]], no_way: Sequence[bool], seconds: float = SECONDS) -> dict[str, Any]:
    """Return the figures of one planner.

    Args:
        found: Its answers, and whether each touches something.
        no_way: Of each problem, whether it is proved to have no way: an answer to it is a wrong one.
        seconds: The time in which a problem counts as solved, s.
    """
    in_time = [answer.path is not None and answer.seconds <= seconds for answer, _ in found]
    within = [row for row, is_in_time, none in zip(found, in_time, no_way, strict=True) if is_in_time and not none]
    counts = {
        "solvable": len(found) - sum(no_way),
        "solved": len(within),
        "wrong": sum(is_in_time and none for is_in_time, none in zip(in_time, no_way, strict=True)),
    }
    if not within:
        return counts
    times = [answer.seconds for answer, _ in within]
    lengths = [np.linalg.norm(np.diff(a.path, axis=0), axis=1).sum() for a, _ in within if a.path is not None]
    durations = [answer.duration for answer, _ in within if answer.duration is not None]
    return counts | {
        "p50": float(np.median(times)),
        "p95": float(np.quantile(times, 0.95)),
        "length": float(np.median(lengths)),
        "duration": float(np.median(durations)) if durations else None,
        "touching": sum(touches for _, touches in within) / len(within),
    }
