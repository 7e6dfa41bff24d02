"""Saved plans of a few kilobytes: polynomials, waypoints and certificate, enough to write every format.

A saved plan does not contain the problem; save that beside it. Loading a plan plans nothing again, so it stays the same
in later versions of the planner.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import ormsgpack

from planner.certificate import ClearanceReport
from planner.certificate.checks import Certificate, Check
from planner.certificate.speed_zones import SpeedZoneCheck
from planner.choices import Choice, OptionOutcome
from planner.free_motion import Detour, Gain, with_detours, with_fixed
from planner.paths import JointPath, dynamics_of, solve_path
from planner.planning.rides import with_planned_ride
from planner.plans.optimisation import Optimisation
from planner.plans.result import Plan
from planner.plans.ride import RideReport
from planner.problems import Expansion, blend_radii, with_blend_radii
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition
from planner.spatial import Pose
from planner.trajectories.trajectory import PlanWarning, Trajectory
from planner.waypoints import SolvedWaypoint

if TYPE_CHECKING:
    from planner.backends.base import BackEnd
    from planner.problems.problem import PlanningProblem

VERSION = 1
"""The version of the saved form, without unit; a change that makes older plans unreadable raises it."""

SMALL = 4096
"""The length below which the content is not compressed, bytes.

Compression shrinks its numbers by a quarter at most, and takes as long as the rest of saving a plan.
"""

OF_THE_PATH = frozenset({"tcp_polynomials", "tcp_speed_report", "proof"})
"""The parts of an answer that need the curves and tool motions of a plan's path."""

Packed = tuple[Sequence[int], bytes]
"""The shape of an array and its bytes."""

ARRAYS = ("lengths", "coefficients", "segments", "arrivals", "departures")
"""The arrays of a trajectory, all of numbers of eight bytes."""

WAYPOINT_FIELDS = ("name", "position_error", "orientation_error", "solutions", "solution", "choice")
"""The fields of a solved waypoint that are saved as they are."""

TRANSITIONS = {kind.__name__: kind for kind in (StopTransition, ThroughTransition, BlendTransition)}
"""The transitions at the corners of a detour, by their saved names."""


def save_plan(plan: Plan) -> bytes:
    """Write a plan for `load_plan`; every number is kept to the last bit."""
    trajectory, waypoints = plan.trajectory, plan.path.waypoints
    rotations = [waypoint.pose.rotation for waypoint in waypoints]
    content = {
        "version": VERSION,
        "trajectory": {name: _packed(getattr(trajectory, name)) for name in ARRAYS},
        "solver": trajectory.solver,
        "waypoints": [[getattr(waypoint, name) for name in WAYPOINT_FIELDS] for waypoint in waypoints],
        "positions": _packed(plan.path.positions),
        "tool_positions": _packed(np.array([waypoint.pose.position for waypoint in waypoints])),
        "tool_rotations": [None if rotation is None else rotation.tobytes() for rotation in rotations],
        "certificate": plan.certificate.as_dict(),
        "blend_radii": list(blend_radii(plan.problem).items()),
        "warnings": [(warning.code, warning.message) for warning in plan.warnings],
        "ways": [
            (
                detour.waypoint,
                _packed(detour.positions),
                type(detour.transition).__name__,
                vars(detour.transition),
                None if detour.gain is None else vars(detour.gain),
                _packed(detour.lead),
            )
            for detour in plan.detours
        ],
        "optimisation": None
        if plan.optimisation is None
        else vars(plan.optimisation)
        | {
            "moved": [(k, _packed(position)) for k, position in plan.optimisation.moved.items()],
            "radii": list(plan.optimisation.radii.items()),
        },
        "rides": [vars(ride) for ride in plan.rides],
        "choices": [vars(choice) | {"options": list(map(vars, choice.options))} for choice in plan.choices],
    }
    packed = ormsgpack.packb(content, option=ormsgpack.OPT_SERIALIZE_NUMPY)
    return zlib.compress(packed, 0 if len(packed) < SMALL else zlib.Z_DEFAULT_COMPRESSION)


def load_plan(content: bytes, problem: PlanningProblem, backend: BackEnd, with_groups: bool = False) -> Plan:
    """Read a plan.

    Args:
        content: The bytes from `save_plan`.
        problem: The problem of the plan. The loaded plan's own problem also has the detours and blend radii that the
            planner found.
        backend: The back end of the plan.
        with_groups: Whether the path also needs its curves and tool motions, as the parts `OF_THE_PATH` do. If so, the
            path is solved again; otherwise the plan's path has none.

    Raises:
        ValueError: The content is no plan of this version.
    """
    saved = ormsgpack.unpackb(zlib.decompress(content))
    if saved["version"] != VERSION:
        raise ValueError(f"a saved plan of version {saved['version']}, not {VERSION}")
    arrays: dict[str, Any] = {name: _unpacked(saved["trajectory"][name]) for name in ARRAYS}
    arrays["segments"] = arrays["segments"].view(np.int64)
    trajectory = Trajectory(**arrays, solver=saved.get("solver"))
    checks = tuple(
        Check(**check | {"relaxed_by": tuple(check.get("relaxed_by", ()))})
        for check in saved["certificate"].pop("checks")
    )
    clearance = saved["certificate"].pop("clearance", None)
    report = None if clearance is None else ClearanceReport.from_dict(clearance)
    zones = tuple(SpeedZoneCheck.from_dict(check) for check in saved["certificate"].pop("speed_zones", ()))
    certificate = Certificate(**saved["certificate"], checks=checks, clearance=report, speed_zones=zones)
    warnings = tuple(PlanWarning(*warning) for warning in saved["warnings"])
    detours = tuple(_way(*detour) for detour in saved.get("ways", ()))
    choices = tuple(_choice(**choice) for choice in saved.get("choices", ()))
    problem = Expansion.of(problem, {choice.waypoint: choice.option or 0 for choice in choices}).problem
    rides = tuple(RideReport(**ride | {"durations": tuple(ride["durations"])}) for ride in saved.get("rides", ()))
    for ride in rides:
        problem = with_planned_ride(problem, ride, trajectory)
    optimisation = _optimisation(saved.get("optimisation"))
    problem = with_fixed(problem, {} if optimisation is None else optimisation.moved)
    problem = with_blend_radii(with_detours(problem, detours), dict(saved.get("blend_radii", ())))
    path = _path(saved, problem)
    if with_groups:
        solved = solve_path(problem)
        pairs = zip(solved.waypoints, path.waypoints, strict=True)
        same = [replace(own, **{name: getattr(other, name) for name in WAYPOINT_FIELDS}) for own, other in pairs]
        path = replace(solved, waypoints=tuple(same))
    return Plan(problem, backend, path, trajectory, certificate, warnings, detours, choices, optimisation, rides)


def _choice(options: list[dict[str, Any]], **fields: Any) -> Choice:
    """Return a choice as it was saved."""
    return Choice(options=tuple(OptionOutcome(**outcome) for outcome in options), **fields)


def _optimisation(saved: dict[str, Any] | None) -> Optimisation | None:
    """Return the report of an optimisation as it was saved."""
    if saved is None:
        return None
    moved = {k: _unpacked(position) for k, position in saved["moved"]}
    return Optimisation(**saved | {"moved": moved, "radii": dict(saved["radii"])})


def _way(
    waypoint: int,
    positions: Packed,
    kind: str,
    transition: dict[str, Any],
    gain: dict[str, Any] | None = None,
    lead: Packed | None = None,
) -> Detour:
    """Return a way as it was saved; the first plans saved have neither gain nor lead."""
    corners = _unpacked(positions)
    before = corners[:0] if lead is None else _unpacked(lead)
    return Detour(waypoint, corners, TRANSITIONS[kind](**transition), before, Gain(**gain) if gain else None)


def _path(saved: dict[str, Any], problem: PlanningProblem) -> JointPath:
    """Return the path with its waypoints as they were solved, and without its curves."""
    rows = zip(
        saved["waypoints"],
        _unpacked(saved["positions"]),
        _unpacked(saved["tool_positions"]),
        saved["tool_rotations"],
        strict=True,
    )
    waypoints = []
    for fields, position, tool_position, rotation in rows:
        matrix = None if rotation is None else np.frombuffer(rotation).reshape(3, 3)
        pose = Pose(tool_position, matrix)
        waypoint = dict(zip(WAYPOINT_FIELDS, fields, strict=True))
        waypoints.append(SolvedWaypoint(wanted=pose, position=position, pose=pose, **waypoint))
    dynamics = dynamics_of(problem)
    segments = len(waypoints) - 1
    return JointPath(
        robot=dynamics.robots[0],
        dynamics=dynamics,
        waypoints=tuple(waypoints),
        limits=problem.segment_limits(),
        durations=np.full(segments, np.nan),
        dwells=np.zeros(segments + 1),
        groups=(),
        tool_motions=(None,) * segments,
    )


def _packed(values: np.ndarray) -> Packed:
    """Return the shape and the bytes of an array, byte by byte of its numbers: so they compress best."""
    values = np.ascontiguousarray(values, dtype=np.int64 if values.dtype.kind == "i" else np.float64)
    return values.shape, values.view(np.uint8).reshape(-1, 8).T.tobytes()


def _unpacked(packed: Packed) -> np.ndarray:
    shape, content = packed
    return np.ascontiguousarray(np.frombuffer(content, np.uint8).reshape(8, -1).T).view(np.float64).reshape(shape)
