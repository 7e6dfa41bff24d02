"""Checks and default limits of a robot description in any format."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from planner.robots.build import Body
from planner.robots.description import RESISTANCES, TOLERANCES, Joint, Provenance
from planner.robots.findings import Findings, listed, shown
from planner.robots.varying.torque_curves import TorqueCurve, torque_curve_faults
from planner.robots.varying.velocity_curves import VelocityCurve, VelocityCurves, VelocityTable, curve_faults

MAX_LINKS = 256
"""Number of links that a model may have; Pinocchio itself dies somewhere between 3000 and 5000."""

MAX_JOINTS = 32
"""Number of joints that an arm may have."""

MAX_NAME_LENGTH = 100
"""Number of characters that a name may have."""

RESERVED_NAME = "universe"
"""Pinocchio's name of the base."""

DYNAMIC_QUANTITIES = ("velocity", "acceleration", "jerk", "torque")
"""Names of the limits that may be missing, which means that there is none."""

MOST_FOLLOWING_ERROR = 0.1
"""Largest following error of a joint, rad or m; the bounds on its effects assume that it is small."""

MAX_NUMBER = 1e9
"""A larger number is an error in a length or a mass, and the usual way to write "no limit" in a limit."""
LEAST_MOMENT = 1e-12
"""Share of the largest principal moment: with a smaller one, Pinocchio may see a negative one and throw."""
MAX_MASS = 1e5
"""kg."""
USUAL_MASSES = (1e-4, 5e3)
"""Usual masses of a link, kg: from a toy to the largest arms."""
TINY_INERTIA = 1e-6
"""kg m^2; rounding makes smaller ones come out negative in many published robot descriptions."""
MAX_LENGTH = 50.0
"""Longest plausible arm, m; longer ones were probably meant in millimetres."""
MAX_CONSTANT_ANGLE = 2.0 * math.pi * 1.001
"""rad; a larger angle between two frames was probably meant in degrees."""
MAX_POSITION = 8.0 * math.pi
"""rad; a joint that turns further, and not for ever, was probably meant in degrees."""
MAX_VELOCITY = 50.0
"""Highest plausible velocity, rad/s or m/s; higher ones were probably meant in degrees/s or mm/s."""
ABSURD_ANGULAR_VELOCITY = 1000.0
"""rad/s; such a limit says that none is known."""
ABSURD_LINEAR_VELOCITY = 100.0
"""m/s; likewise."""
LEAST_LIMIT = 1e-6
"""rad/s, m/s, ..., N; with a smaller limit than this nothing moves."""

LEAST_OF_CURVES = 0.02
"""Share of the velocity limit that velocity curves allow at least: a position where they allow less is out of reach."""

MOST_CURVES = 8
"""Number of velocity curves that a joint may have in one direction."""

DEFAULT_ANGULAR_VELOCITY = math.pi
"""rad/s."""
DEFAULT_LINEAR_VELOCITY = 1.0
"""m/s."""
DEFAULT_ACCELERATION_PER_VELOCITY = 4.0
"""1/s: full speed in 0.25 s."""
DEFAULT_JERK_PER_ACCELERATION = 10.0
"""1/s: full acceleration in 0.1 s."""


def check_names(what: str, names: Iterable[str], findings: Findings) -> None:
    """Check that every name of a link or joint is printable, unique, not reserved, and of reasonable length."""
    seen: set[str] = set()
    for name in names:
        if not name or len(name) > MAX_NAME_LENGTH or not name.isprintable() or name != name.strip():
            message = f"a {what} needs a printable name of 1 to {MAX_NAME_LENGTH} characters, no space at its ends"
            findings.error("invalid_name", shown(name), message)
        elif name == RESERVED_NAME:
            findings.error("reserved_name", name, f"no {what} may be called {name}")
        elif name in seen:
            findings.error("duplicate_name", name, f"there are two {what}s called {name}")
        seen.add(name)


def check_length(subject: str, lengths: Iterable[float], findings: Findings) -> None:
    """Warn of lengths (m) that no robot arm has."""
    longest = max((abs(length) for length in lengths), default=0.0)
    if longest > MAX_LENGTH:
        findings.warning("suspicious_length", subject, f"{longest:g} m is long for a robot arm: is it in metres?")


def check_angles(subject: str, angles: Iterable[float], findings: Findings) -> None:
    """Warn of constant angles (rad) beyond a full turn."""
    largest = max(abs(angle) for angle in angles)
    if largest > MAX_CONSTANT_ANGLE:
        text = f"an angle of {subject} is {largest:g}, more than a full turn: is it in radians?"
        findings.warning("suspicious_angle", subject, text)


def check_body(subject: str, body: Body, findings: Findings) -> Body:
    """Check the mass and inertia of a body; raise moments that rounding made negative.

    The inertia tensor about the center of mass has three positive eigenvalues, none larger than the sum of the
    other two. A tensor that is not positive makes the equations of motion unsolvable. A tensor that only breaks the
    triangle inequality is impossible but harmless, and many published robot descriptions have one.
    """
    if body.mass < 0.0:
        findings.error("negative_mass", subject, f"the mass of {subject} is {body.mass:g} kg")
    elif body.mass > MAX_MASS:
        findings.error("absurd_mass", subject, f"the mass of {subject} is {body.mass:g} kg, above {MAX_MASS:g} kg")
    elif body.mass > 0.0 and not USUAL_MASSES[0] <= body.mass <= USUAL_MASSES[1]:
        text = f"{body.mass:g} kg is unusual for a link of a robot arm: is it in kilograms?"
        findings.warning("suspicious_mass", subject, text)
    check_length(subject, body.center_of_mass, findings)
    moments, axes = np.linalg.eigh(body.inertia)
    tolerance = 1e-9 * abs(moments).max()
    if moments[0] < -tolerance:
        report = findings.error if moments[0] < -TINY_INERTIA else findings.warning
        text = f"the inertia of {subject} is not positive definite: its principal moments are {_listed(moments)}"
        report("inertia_not_positive_definite", subject, text)
    elif body.mass == 0.0 and moments[2] > 0.0:
        findings.warning("inertia_without_mass", subject, f"{subject} has an inertia but no mass")
    elif body.mass > 0.0 and moments[0] <= tolerance:
        findings.warning("inertia_missing", subject, f"{subject} has a mass but no full inertia: it counts as a point")
    elif moments[2] > moments[0] + moments[1] + 1e-6 * moments[2]:
        text = f"the inertia of {subject} breaks the triangle inequality: its principal moments are {_listed(moments)}"
        findings.warning("inertia_triangle_inequality", subject, text)
    least = LEAST_MOMENT * max(float(moments[2]), 0.0)
    if moments[0] >= least:
        return body
    lifted = axes @ np.diag(np.maximum(moments, least)) @ axes.T
    return replace(body, inertia=(lifted + lifted.T) / 2.0)


def _listed(numbers: Iterable[float]) -> str:
    return ", ".join(f"{number:.3g}" for number in numbers)


def check_position_limits(joint: Joint, findings: Findings) -> Joint:
    """Return the joint with position limits that leave it room; a bound beyond 1e9 is none."""
    if joint.kind == "continuous":
        if math.isfinite(joint.lower) or math.isfinite(joint.upper):
            text = f"{shown(joint.name)} is continuous: its position limits are ignored"
            findings.info("position_limit_ignored", shown(joint.name), text)
        return replace(joint, lower=-math.inf, upper=math.inf)
    lower, upper = (math.copysign(math.inf, x) if abs(x) > MAX_NUMBER else x for x in (joint.lower, joint.upper))
    if math.isfinite(lower) != math.isfinite(upper):
        text = f"{shown(joint.name)} has a position limit on one side only: give both, or none"
        findings.error("one_sided_position_limit", shown(joint.name), text)
    elif not lower < upper:
        text = f"the lower position limit {lower:g} of {shown(joint.name)} is not below the upper one {upper:g}"
        findings.error("lower_not_below_upper", shown(joint.name), text)
    return replace(joint, lower=lower, upper=upper)


def held_joints(joints: Iterable[Joint], findings: Findings) -> dict[str, float]:
    """Return the positions, rad or m, of joints whose position limits are equal: they count as fixed there."""
    held = {}
    for joint in joints:
        if joint.kind != "continuous" and joint.lower == joint.upper and abs(joint.lower) <= MAX_NUMBER:
            name, held[joint.name] = shown(joint.name), joint.lower
            text = f"both position limits of {name} are {joint.lower:g}: it is fixed there and is no joint of the arm"
            findings.warning("fixed_by_limits", name, text)
    return held


def check_limits(joint: Joint, findings: Findings) -> Joint:
    """Return a joint with plausible motion limits, and default limits for missing ones.

    Zero, anything beyond 1e9, and speeds that no machine has are usual ways to write that a limit is not known.
    """
    known: dict[str, Any] = {}
    name = shown(joint.name)
    for quantity in DYNAMIC_QUANTITIES:
        value = getattr(joint, quantity)
        if value < 0.0:
            findings.error("negative_limit", name, f"the {quantity} limit of {name} is {value:g}")
        elif value == 0.0 and quantity != "torque":
            text = f"the {quantity} limit of {name} is 0: the default limit takes its place"
            findings.warning("zero_limit", name, text)
        elif value == 0.0:
            findings.info("no_torque_limit", name, f"the torque limit of {name} is 0: none is known")
        elif 0.0 < value < LEAST_LIMIT:
            text = f"the {quantity} limit of {name} is {value:g}: nothing moves below {LEAST_LIMIT:g}"
            findings.error("absurd_limit", name, text)
        known[quantity] = value if 0.0 < value <= MAX_NUMBER else math.inf
    _check_units(joint, findings)
    known["velocity"] = _believable_velocity(replace(joint, velocity=known["velocity"]), findings)
    published: dict[str, Provenance] = {}
    if math.isfinite(joint.lower) or math.isfinite(joint.upper):
        published["position"] = "published"
    for quantity in DYNAMIC_QUANTITIES:
        if math.isfinite(known[quantity]):
            published[quantity] = "published"
    complete = with_default_limits(replace(joint, **known, provenance=published))
    defaults = [f"{q} {getattr(complete, q):g}" for q, origin in complete.provenance.items() if origin == "default"]
    if defaults:
        text = f"limits of {name} by the default rule, in SI units: {', '.join(defaults)}"
        findings.info("default_limits", name, text)
    return complete


def _check_units(joint: Joint, findings: Findings) -> None:
    """Warn of position limits that look like degrees or millimetres."""
    name = shown(joint.name)
    bounds = [abs(bound) for bound in (joint.lower, joint.upper) if math.isfinite(bound)]
    if not joint.is_angle:
        check_length(name, bounds, findings)
    elif max(bounds, default=0.0) > MAX_POSITION:
        text = f"the position limits of {name} go up to {max(bounds):g}: are they in radians?"
        findings.warning("suspicious_angle", name, text)


def _believable_velocity(joint: Joint, findings: Findings) -> float:
    """Return the velocity limit, or infinity in place of one that no machine has."""
    name = shown(joint.name)
    absurd = ABSURD_ANGULAR_VELOCITY if joint.is_angle else ABSURD_LINEAR_VELOCITY
    if absurd <= joint.velocity < math.inf:
        text = f"the velocity limit of {name} is {joint.velocity:g}, as good as none: the default limit takes its place"
        findings.warning("absurd_limit", name, text)
        return math.inf
    if MAX_VELOCITY < joint.velocity < math.inf:
        code, unit = ("suspicious_angle", "radians") if joint.is_angle else ("suspicious_length", "metres")
        findings.warning(code, name, f"the velocity limit of {name} is {joint.velocity:g}: is it in {unit}/s?")
    return joint.velocity


def with_default_limits(joint: Joint) -> Joint:
    """Return the joint with the default velocity, acceleration and jerk limit where it has none."""
    velocity, acceleration, jerk = joint.velocity, joint.acceleration, joint.jerk
    provenance = dict(joint.provenance)
    if not math.isfinite(velocity):
        velocity = DEFAULT_ANGULAR_VELOCITY if joint.is_angle else DEFAULT_LINEAR_VELOCITY
        provenance["velocity"] = "default"
    if not math.isfinite(acceleration):
        acceleration = DEFAULT_ACCELERATION_PER_VELOCITY * velocity
        provenance["acceleration"] = "default"
    if not math.isfinite(jerk):
        jerk = DEFAULT_JERK_PER_ACCELERATION * acceleration
        provenance["jerk"] = "default"
    return replace(joint, velocity=velocity, acceleration=acceleration, jerk=jerk, provenance=provenance)


def with_velocity_curves(joint: Joint, curves: VelocityCurves, findings: Findings) -> Joint:
    """Return the joint with velocity curves beside its own, and position limits within which it can move both ways."""
    name, together = shown(joint.name), joint.velocity_curves.with_others(curves)
    faults = [fault for curve in (*curves.upper, *curves.lower) for fault in curve_faults(curve)]
    if max(len(together.upper), len(together.lower)) > MOST_CURVES:
        faults.append(f"a direction may have up to {MOST_CURVES}")
    least = LEAST_OF_CURVES * joint.velocity
    upper = min([joint.upper, *(_reach(curve, least, 1.0) for curve in curves.upper if not faults)])
    lower = max([joint.lower, *(_reach(curve, least, -1.0) for curve in curves.lower if not faults)])
    if not lower < upper:
        faults.append("they leave no position at which the joint can move both ways")
    for fault in faults:
        findings.error("invalid_velocity_curve", name, f"velocity curves of {name}: {fault}")
    if faults:
        return joint
    if (lower, upper) != (joint.lower, joint.upper):
        text = (
            f"the position limits of {name} are {lower:.6g} to {upper:.6g}: "
            f"beyond, its velocity curves allow less than {100.0 * LEAST_OF_CURVES:g} % of its velocity limit"
        )
        findings.info("position_limits_narrowed", name, text)
    changed = replace(joint, lower=lower, upper=upper, velocity_curves=together)
    if joint.kind == "continuous" and math.isfinite(lower) != math.isfinite(upper):
        findings.error("one_sided_position_limit", name, f"velocity curves of {name}: give both directions a parabola")
    elif joint.kind == "continuous" and math.isfinite(lower):
        changed = replace(changed, kind="revolute")
    return changed


def with_torque_curve(joint: Joint, curve: TorqueCurve, findings: Findings) -> Joint:
    """Return the joint with a torque curve; the torque limit is at most that at rest."""
    name, faults = shown(joint.name), list(torque_curve_faults(curve))
    if not faults and joint.torque_curve is not None and curve.exceeds(joint.torque_curve):
        faults.append("it must not be above the curve that it replaces")
    for fault in faults:
        findings.error("invalid_torque_curve", name, f"torque curve of {name}: {fault}")
    return joint if faults else replace(joint, torque=min(joint.torque, curve.torques[0]), torque_curve=curve)


def with_checked_drives(joints: Iterable[Joint], findings: Findings) -> tuple[Joint, ...]:
    """Return the joints without implausible friction and rotor inertia, and note which joints have any."""
    checked = tuple(_checked_drive(joint, findings) for joint in joints)
    follows = any(joint.following_error for joint in checked)
    for joint in checked:
        faults = list(_tolerance_faults(joint))
        if follows and not joint.is_angle and not math.isfinite(joint.upper - joint.lower):
            faults.append("a joint that slides must have position limits on a robot with following errors")
        for fault in faults:
            findings.error("invalid_tolerance", shown(joint.name), f"{shown(joint.name)}: {fault}")
    with_drives = [joint for joint in checked if joint.has_drive]
    if with_drives:
        text = f"torques have the friction and the rotor inertia of {listed(joint.name for joint in with_drives)}"
        without = listed(joint.name for joint in checked if not joint.has_drive)
        text += f"; neither is known of {without}" if without else ""
        findings.info("joint_friction", None, text)
    for joint in with_drives:
        fastest = joint.friction + joint.damping * joint.velocity
        if fastest >= joint.torque:
            name = shown(joint.name)
            text = (
                f"the friction of {name} is {fastest:g} at its velocity limit, its torque limit is {joint.torque:g}: "
                "friction that keeps simulations stable is too large for planning"
            )
            findings.warning("large_friction", name, text)
    return checked


def _tolerance_faults(joint: Joint) -> Iterator[str]:
    """Yield the faults of the tolerances and the following error of a joint."""
    for name, tolerance in zip(RESISTANCES, TOLERANCES, strict=True):
        value, most = getattr(joint, tolerance), getattr(joint, name)
        if not 0.0 <= value <= most:
            yield f"its {tolerance.replace('_', ' ')} must be from 0 to its {name}, {most:g}; got {value:g}"
    error, room = joint.following_error, joint.upper - joint.lower
    if not 0.0 <= error <= MOST_FOLLOWING_ERROR or not 2.0 * error < room:
        most = min(MOST_FOLLOWING_ERROR, 0.5 * room)
        yield f"its following error must be from 0 to {most:g}, below half its range of positions; got {error:g}"


def _checked_drive(joint: Joint, findings: Findings) -> Joint:
    """Return a joint whose implausible values are 0."""
    name = shown(joint.name)
    known: dict[str, Any] = {value: float(getattr(joint, value)) for value in (*RESISTANCES, "rotor_inertia")}
    for value, number in known.items():
        limit = joint.torque if value == "friction" else math.inf
        if not 0.0 <= number <= MAX_NUMBER or not number < limit:
            bound = f"{MAX_NUMBER:g}" if number >= MAX_NUMBER or limit == math.inf else f"its torque limit {limit:g}"
            text = f"the {value.replace('_', ' ')} of {name} is {number:g}, not from 0 to {bound}: it is left out"
            findings.warning("implausible_friction", name, text)
            known[value] = 0.0
    return replace(joint, **known)


def _reach(curve: VelocityCurve, speed: float, sign: float) -> float:
    """Return the last position at which a curve allows a speed in the direction of a sign."""
    if isinstance(curve, VelocityTable):  # its velocities are positive everywhere
        return sign * math.inf
    return curve.end - sign * (speed + curve.offset) ** 2 / curve.rate
