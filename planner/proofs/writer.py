"""Proof files of plans: the intervals and planes are found with the checker's own arithmetic."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from planner.certificate.clearance import segment_checkers
from planner.kinematics.forward import tool_poses
from planner.plans.result import Plan
from planner.proofs.checker import (
    BOUNDED_CLAIMS,
    CONTACT,
    DIGESTED,
    DISTANCE_CLAIMS,
    FORMAT,
    TOOL_CLAIMS,
    Motion,
    Proof,
    check_file,
    digest,
)
from planner.proofs.guides import NODES, shares_of
from planner.proofs.moving_workpieces import MOVES, rotation_of
from planner.proofs.polynomial_paths import PolynomialPath
from planner.proofs.statement import met_waypoints, motion_of, pairs_of, paths_of, statement_of
from planner.scene.checker import CollisionChecker
from planner.scene.separations import UNIT_ERROR
from planner.spatial import FloatArray

MOST_HALVINGS_OF_PIECE = 14
"""Number of times that an interval of a piece is halved before its claim is left out of the proof."""

PATH = {"path_deviation"}
"""The claim that needs the share of the path by time."""

SLOW = "slow"
"""The evidence of a pair of a speed zone in an interval in which the robot keeps the speed of the zone."""

SHORT_NORMAL = 3
"""Decimal places of normals that prove enough."""


def write_proof(plan: Plan) -> dict[str, Any]:
    """Write the proof of a plan's certificate as plain values, ready for JSON.

    A claim that needs too many intervals stands under `not_covered`.

    Args:
        plan: The plan, whose certificate is satisfied.

    Examples:
        >>> import planner
        >>> robot = planner.load_robot("kuka_kr16_2")
        >>> home = planner.JointWaypoint([0.0, -1.5, 1.5, 0.0, 0.5, 0.0])
        >>> pick = planner.JointWaypoint([1.0, -1.2, 1.2, 0.0, 0.5, 0.5])
        >>> plan = planner.plan(planner.PlanningProblem(robot, [home, pick]), planner.Trapezoidal())
        >>> proof = planner.write_proof(plan)
        >>> "velocity" in planner.check_proof(proof)
        True
    """
    follows = plan.path.robot.following_errors is not None
    content = _written(plan, follows=follows)
    parts = (text.partition(": ") for text in content["statement"]["not_covered"])
    if follows and {name for name, _, reason in parts if reason != MOVES} & {"torque", *TOOL_CLAIMS}:
        return _written(plan, follows=False)
    return content


def _written(plan: Plan, *, follows: bool) -> dict[str, Any]:
    """Write a proof for all positions within the following errors, or for planned positions."""
    content = _unproved(statement_of(plan, follows=follows), motion_of(plan))
    finder = _Finder(plan, Proof(content))
    content["evidence"] |= finder.bounded()
    content["evidence"] |= {name: finder.distances(name) for name in DISTANCE_CLAIMS}
    for claim, reason in finder.left_out.items():
        content["statement"]["claims"].remove(claim)
        content["statement"]["not_covered"].append(f"{claim}: {reason}")
    content["digests"] = {name: digest(content[name]) for name in DIGESTED}
    return content


def _unproved(statement: dict[str, Any], motion: dict[str, Any]) -> dict[str, Any]:
    """Return a proof without evidence."""
    evidence: dict[str, Any] = {name: [] for name in ("bounded", "along", *DISTANCE_CLAIMS)}
    parts = {"statement": statement, "trajectory": motion, "evidence": evidence}
    return {"format": FORMAT, "digests": {name: digest(part) for name, part in parts.items()}, **parts}


def check_proof(proof: str | bytes | dict[str, Any], expected: Mapping[str, str | None] | None = None) -> list[str]:
    """Check a proof and return its claims.

    Args:
        proof: The content of a file, or the proof in an answer.
        expected: Expected digests by `statement`, `trajectory` and `evidence`; None: any.

    Raises:
        ProofRejected: The proof is malformed, has another digest, or a claim is not proved.
    """
    text = json.dumps(proof, allow_nan=False) if isinstance(proof, dict) else proof
    return check_file(text.encode() if isinstance(text, str) else text, expected).claims


class _Finder:
    """The search for the intervals and planes of a proof.

    Attributes:
        left_out: The claims that would need too many intervals, and why they are left out.
    """

    def __init__(self, plan: Plan, proof: Proof) -> None:
        self.left_out: dict[str, str] = {}
        self._plan, self._proof = plan, proof
        self._checkers = segment_checkers(plan.problem, plan.path.positions)
        self._pairs = {checker: pairs_of(checker, plan.problem.speed_zones) for checker in self._checkers}
        self._paths = paths_of(plan, met_waypoints(plan))

    def bounded(self) -> dict[str, Any]:
        """Return the ends of the intervals on which all bounds are proved, and the shares of paths on them."""
        claims, ends, along = set(self._proof.claims) & set(BOUNDED_CLAIMS), [0.0], list[Any]()
        waiting = [(float(k), k + 1.0, 0) for k in reversed(range(self._proof.pieces))]
        while waiting and claims:
            start, end, depth = waiting.pop()
            motion, segment = self._proof.motion(start, end)
            failed = motion.unproved(claims - PATH, self._proof.limits, segment, None)
            guided = PATH & claims and self._proof.limits["path_deviation"][segment] is not None
            is_last = depth == MOST_HALVINGS_OF_PIECE
            shares = self._shares(motion, start, end) if guided and (is_last or not failed) else None
            failed |= PATH if guided and shares is None else set()
            if failed and is_last:
                self.left_out |= dict.fromkeys(sorted(failed), "it needs too many intervals")
                claims -= failed
            elif failed:
                middle = (start + end) / 2.0
                waiting += [(middle, end, depth + 1), (start, middle, depth + 1)]
                continue
            ends.append(end)
            along.append(shares)
        return {"bounded": ends if claims else [], "along": along if claims & PATH else []}

    def _shares(self, motion: Motion, start: float, end: float) -> Any:
        """Return the shares of the path on an interval, or the number of a blend; None: they prove nothing."""
        piece, limits = int(start), self._proof.limits
        segment = self._proof.segments[piece]
        path = self._paths[segment]
        assert path is not None  # noqa: S101 - it has a guide
        times = (start + (end - start) * (NODES + 1.0) / 2.0 - piece) * self._plan.trajectory.lengths[piece]
        (joints,) = self._plan.trajectory.evaluate_on(np.full(len(times), piece), times, [0])
        poses = tool_poses(self._plan.path.dynamics.robot_on(segment), joints)
        blends = range(len(limits["path_deviation"][segment]["blends"]))
        of_path = path.choices(poses[0]) if isinstance(path, PolynomialPath) else [[0, *shares_of(path, *poses)]]
        choices = [*of_path, *blends]
        return next((x for x in choices if not motion.unproved(PATH, limits, segment, x)), None)

    def distances(self, name: str) -> list[Any]:
        """Return intervals with the planes that keep pairs apart on them, or with slow robots."""
        if name not in self._proof.claims:
            return []
        scenes, nodes = self._proof.statement["scenes"], []
        waiting = [
            (float(first), float(last), 0, list(range(len(scenes[scene][name]))))
            for first, (scene, last) in self._proof.stretches().items()
        ]
        while waiting:
            start, end, depth, pairs = waiting.pop()
            found, left = self._evidence(name, start, end, pairs)
            if found:
                nodes.append([start, end, found])
            if left and depth == MOST_HALVINGS_OF_PIECE:
                checker = self._checker(start)
                first, second = checker.names(self._pairs[checker][name][left[0]][0])
                self.left_out[name] = f"{first} and {second} need too many intervals"
                return []
            if left:
                several = end - start > 1.0
                middle = start + round((end - start) / 2.0) if several else (start + end) / 2.0
                waiting += [
                    (part, stop, depth + (not several), left) for part, stop in ((middle, end), (start, middle))
                ]
        return nodes

    def _checker(self, time: float) -> CollisionChecker:
        """Return the collision checker at a time, the number of a piece and a share of it."""
        return self._checkers[min(self._proof.segments[int(time)], len(self._checkers) - 1)]

    def _evidence(self, name: str, start: float, end: float, pairs: Sequence[int]) -> tuple[list[Any], list[int]]:
        """Return the evidence of pairs on an interval, and the pairs for which none is found."""
        motion, segment = self._proof.motion(start, end)
        checker, scene = self._checker(start), self._proof.statement["scenes"][self._proof.scene_of[segment]]
        trajectory, numbers, middle = self._plan.trajectory, self._pairs[checker][name], (start + end) / 2.0
        piece = np.array([int(middle)])
        (position,) = trajectory.evaluate_on(piece, (middle - piece) * trajectory.lengths[piece], [0])
        placements = checker.bodies.at(position)
        found: list[Any] = []
        left: list[int] = []
        for pair in pairs:
            first, limits = scene["shapes"][scene[name][pair][0]], numbers[pair][1]
            choices: list[Any] = []
            if name == "speed_zones" and end - start <= 1.0 and motion.is_safe(scene, scene[name][pair], SLOW):
                choices = [SLOW]
            elif "offset" in first:
                choices = [None]
            elif (apart := checker.separate(placements, 0, numbers[pair][0])).distance >= limits[0] - CONTACT:
                is_first = scene[name][pair][0] == checker.numbers_of(np.array([numbers[pair][0]]))[0, 0]
                rotation = rotation_of(self._plan.path.robot, first["joint"], placements.rotations[0])
                choices = _in_frame(rotation, apart.normal if is_first else -apart.normal)
            evidence = next((own for own in choices if motion.is_safe(scene, scene[name][pair], own)), left)
            if evidence is left:
                left.append(pair)
            else:
                found.append([pair, evidence])
        return found, left


def _in_frame(rotation: FloatArray, normal: FloatArray) -> list[list[float] | None]:
    """Return a normal in a joint's frame, with few digits first; none without a direction."""
    own = rotation.T @ normal
    return (
        [own.round(SHORT_NORMAL).tolist(), own.tolist()] if abs(float(np.linalg.norm(own)) - 1.0) < UNIT_ERROR else []
    )
