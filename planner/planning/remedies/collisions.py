"""Remedies for collisions: a stop, a detour or a motion above the obstacle, another configuration."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from planner.certificate.clearance import CLEARANCE_TOLERANCE, segment_checkers
from planner.errors import ClearanceUnproved, Collision, Remedy
from planner.free_motion.detours import last_of
from planner.kinematics.configurations import BEHIND, POSITIVE_NAMES, Configuration, named_parts
from planner.planning.attempts import Attempt, Planned, Proposals, Refused
from planner.planning.moving.waits import waits_for_objects
from planner.planning.proofs import QUICK_CHECKS, first_proved, plan_with, proved
from planner.problems.motion_around import FreeMotion
from planner.problems.problem import JointMotion, JointWaypoint, PlanningProblem, PolylineMotion, PoseWaypoint
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition
from planner.scene import is_free
from planner.spatial import Pose

HEIGHTS = (0.1, 0.25, 0.5)
"""Heights above the higher end of a motion at which the tool passes over an obstacle, m."""

CORNERS = 0.3
"""Share of the height by which the corners of that way are cut."""

DRAWN_BACK = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2)
"""Distances, m, by which the tool stays back from a goal in collision; the least one that is planned is offered."""

SHARES_OF_THE_WAY = (0.99, 0.95, 0.9, 0.8, 0.5)
"""Shares of the straight way to a joint position in collision after which the robot may stay."""

MOST_TRIED_CHANGES = 10
"""Number of changes that are tried, each of which is a whole plan."""

MOST_HELPING = 3
"""Number of changes that are offered."""


def collision_remedies(refused: Refused, refusal: Collision | ClearanceUnproved) -> Proposals[list[Remedy]]:
    """Find changes with each of which the problem has been planned."""
    helping: list[Remedy] = yield from first_proved(waits_for_objects(refused), refused.attempt)
    tried = 0
    for alternatives in _candidates(refused, refusal):
        if tried >= MOST_TRIED_CHANGES or len(helping) >= MOST_HELPING:
            break
        tried += len(alternatives)
        helping += yield from first_proved([[remedy] for remedy in alternatives], refused.attempt)
    if refusal.limit and (refusal.value is None or refusal.value > 0.0):
        helping += yield from smaller_margin(refused.attempt, refusal.pair)
    return helping


def _candidates(refused: Refused, refusal: Collision | ClearanceUnproved) -> Iterator[list[Remedy]]:
    """Yield changes, the first of several alternatives that helps being enough."""
    if not isinstance(refusal, Collision):
        return  # what takes long to prove would take as long again with every change
    problem, at = refused.attempt.problem, _waypoint_in_collision(refused.attempt, refusal)
    if at is not None:
        yield from ([remedy] for remedy in _other_configurations(problem, [at]))
        yield list(_nearer_goals(problem, at))
        yield list(_allowed_contacts(problem, refusal.pair))
        return
    if refusal.segment is None:
        return
    ends = range(refusal.segment, refusal.segment + 2)
    for i in ends:
        if isinstance(problem.waypoints[i].transition, BlendTransition | ThroughTransition):
            field = ("waypoints", i, "transition")
            yield [Remedy(field, StopTransition(), "with a stop the robot goes straight to the waypoint")]
    yield from ([remedy] for remedy in _other_ways(refused.attempt, refusal.segment))
    yield from ([remedy] for remedy in _other_configurations(problem, ends))


def _waypoint_in_collision(attempt: Attempt, refusal: Collision) -> int | None:
    """Return the waypoint at which the robot collides; None: it does so on its way only."""
    if refusal.waypoint is not None or refusal.segment is None:
        return refusal.waypoint
    path, problem = attempt.solved, attempt.with_detours
    if len(path.waypoints) == 1:
        return 0
    index, checkers = last_of(problem, refusal.segment + 1), segment_checkers(problem, path.positions)
    is_clear = is_free(checkers[index - 1], path.positions[index][None])[0]
    return None if is_clear else refusal.segment + 1


def _nearer_goals(problem: PlanningProblem, at: int) -> Iterator[Remedy]:
    """Yield goals that the robot comes to before it collides: back along the tool's axis, or on its straight way."""
    goal, before = problem.waypoints[at], problem.waypoints[max(0, at - 1)]
    if at > 0 and isinstance(goal, PoseWaypoint) and goal.pose.rotation is not None:
        for back in DRAWN_BACK:
            pose = replace(goal.pose, position=goal.pose.position - back * goal.pose.rotation[:, 2])
            yield Remedy(("waypoints", at, "pose"), pose, f"the tool stays {back:g} m back along its axis")
    elif at > 0 and isinstance(goal, JointWaypoint) and isinstance(before, JointWaypoint):
        start, end = np.array(before.position), np.array(goal.position)
        for share in SHARES_OF_THE_WAY:
            position = tuple((start + share * (end - start)).tolist())
            yield Remedy(("waypoints", at, "position"), position, f"after {share:.0%} of the way to the waypoint")


def _allowed_contacts(problem: PlanningProblem, pair: tuple[str, str]) -> Iterator[Remedy]:
    """Yield contacts that may be meant: of the pair that is too near, and of the robot with that object."""
    scene = problem.scene
    if scene is None:
        return
    field = ("scene", "allowed_pairs")
    yield Remedy(field, (*scene.allowed_pairs, pair), "if these two may touch")
    if pair[1] in {thing.id for thing in scene.objects}:
        moving = dict.fromkeys([shape.link for shape in problem.robot.collision_shapes])
        left_out = tuple((link, pair[1]) for link in [*moving, *(thing.id for thing in scene.attached)])
        yield Remedy(
            field, (*scene.allowed_pairs, *left_out), f"if {pair[1]} is left out: the whole robot may touch it"
        )


def _other_configurations(problem: PlanningProblem, ends: Iterable[int]) -> Iterator[Remedy]:
    """Yield the configurations that a pose at an end of the motion may be reached in besides."""
    parts = named_parts(problem.robot)
    sides = dict(zip(("shoulder", "elbow", "wrist"), zip(BEHIND, POSITIVE_NAMES, strict=True), strict=True))
    for i in ends:
        waypoint = problem.waypoints[i]
        if not isinstance(waypoint, PoseWaypoint) or waypoint.configuration.names:
            continue
        for names in product(*(sides[part] for part in parts)):
            named = Configuration(**dict(zip(parts, names, strict=True)))  # type: ignore[arg-type]
            yield Remedy(("waypoints", i, "configuration"), named, "the arm goes another way in this configuration")


def _other_ways(attempt: Attempt, segment: int) -> Iterator[Remedy]:
    """Yield a free motion, and tool motions up, across and down again.

    Only a joint motion between stops gives way to them.
    """
    problem = attempt.problem
    first, second = problem.waypoints[segment], problem.waypoints[segment + 1]
    stops = isinstance(first.transition, StopTransition) and isinstance(second.transition, StopTransition)
    if not stops or not isinstance(second.motion, JointMotion):
        return
    field = ("waypoints", segment + 1, "motion")
    if not (second.duration or second.minimum_duration or isinstance(second.motion, FreeMotion)):
        yield Remedy(field, FreeMotion(most_checks=QUICK_CHECKS), "a collision-free path around the obstacle")
    mounting = problem.robot.mounting
    up = np.array([0.0, 0.0, 1.0]) if mounting is None or mounting.rotation is None else mounting.rotation[2]
    solved = dict(zip(attempt.with_detours.numbers, attempt.solved.waypoints, strict=True))  # corners come first
    start, end = solved[segment].pose, solved[segment + 1].pose
    top = max(float(start.position @ up), float(end.position @ up))
    for height in HEIGHTS:
        poses = [Pose(p.position + (top + height - float(p.position @ up)) * up, p.rotation) for p in (start, end)]
        motion = PolylineMotion(poses, CORNERS * height)
        explanation = f"a higher approach: the tool goes over it, {height:g} m above the higher end"
        yield Remedy(field, motion, explanation)


def smaller_margin(attempt: Attempt, pair: Collection[str]) -> Proposals[list[Remedy]]:
    """Find the largest margin, in whole millimetres, for which a plan exists; none if there is none.

    Args:
        attempt: The attempt that was refused.
        pair: The pair that comes too near; its own margin changes, if it has one.
    """
    scene = attempt.problem.scene
    if scene is None:
        return []
    no_margins = tuple(replace(thing, margin=None) for thing in scene.objects)
    free = replace(scene, margin=CLEARANCE_TOLERANCE, objects=no_margins)  # nearer is what is taken and put down
    outcome = yield from plan_with([Remedy(("scene",), free, "")], attempt)
    report = outcome.plan.certificate.clearance if isinstance(outcome, Planned) else None
    if report is None or report.scene is None:
        return []
    kept = np.floor((report.scene.lower - CLEARANCE_TOLERANCE / 2.0) / CLEARANCE_TOLERANCE) * CLEARANCE_TOLERANCE
    own = [i for i, thing in enumerate(scene.objects) if thing.id in pair and thing.margin is not None]
    field = ("scene", "objects", own[0], "margin") if own else ("scene", "margin")
    if kept <= 0.0:
        return []
    remedy = Remedy(field, float(round(kept, 6)), "the motion keeps this much clear as it is")
    return (yield from proved([remedy], attempt))
