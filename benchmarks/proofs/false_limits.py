"""Changes to proof files after which a limit of the trajectory is exceeded."""

from __future__ import annotations

from typing import Any

import numpy as np

from planner.proofs.checker import AT_SPEED_CLAIMS, BOUNDED_CLAIMS, JOINT_CLAIMS, TOOL_CLAIMS, Motion, Proof

Content = dict[str, Any]

OF_POSES = ("path_deviation", "tool_pose")
"""Claims about the pose of the tool, whose limits are no single numbers."""

LINES = (*AT_SPEED_CLAIMS, *OF_POSES)
"""Claims whose limits are no single numbers."""

NOTICEABLE = 1e-3
"""Smallest change of a position that a tampered file has, rad or m."""


def change_limit(content: Content, generator: np.random.Generator) -> bool:
    """Lower the limit of a joint below a value that the trajectory reaches."""
    limits, motion = content["statement"]["limits"], content["trajectory"]
    name = generator.choice([name for name in JOINT_CLAIMS[1:] if name in limits])
    order = JOINT_CLAIMS.index(name)
    piece = int(generator.integers(len(motion["lengths"])))
    joint = int(generator.integers(len(motion["coefficients"][piece])))
    u = motion["lengths"][piece] * generator.random()
    reached = np.polynomial.Polynomial(motion["coefficients"][piece][joint]).deriv(order)(u)
    if abs(reached) < NOTICEABLE:
        return False
    side = limits[name][motion["segments"][piece]][int(reached > 0.0)]
    side[joint] = reached * generator.uniform(0.1, 0.999)
    return True


def change_curve(content: Content, generator: np.random.Generator) -> bool:
    """Lower a velocity limit that depends on the position below a velocity that the trajectory reaches there."""
    limits, motion = content["statement"]["limits"], content["trajectory"]
    if "velocity_at_position" not in content["statement"]["claims"]:
        return False
    piece = int(generator.integers(len(motion["lengths"])))
    joint = int(generator.integers(len(motion["coefficients"][piece])))
    curves = limits["velocity_at_position"][joint]
    if not curves:
        return False
    curve = curves[int(generator.integers(len(curves)))]
    row, u = (
        np.polynomial.Polynomial(motion["coefficients"][piece][joint]),
        motion["lengths"][piece] * generator.random(),
    )
    sign = -1.0 if curve["towards"] == "lower" else 1.0
    p, w = sign * row(u), sign * row.deriv()(u) / limits["velocity_scale"][motion["segments"][piece]]
    low, high = (curve[end] if curve[end] is not None else p for end in ("low", "high"))
    if w < NOTICEABLE or not low <= p <= high:
        return False
    square, linear, _, slope = curve["coefficients"]
    curve["coefficients"][2] = (square * w * w + linear * w - slope * p) - 10.0 ** generator.uniform(-4, 0) * w
    return True


def change_bounded_limit(content: Content, generator: np.random.Generator) -> bool:
    """Lower a limit of torque, power or the tool below a value that the trajectory reaches."""
    statement = content["statement"]
    names = [name for name in BOUNDED_CLAIMS if name in statement["claims"] and name not in LINES]
    if not names:
        return False
    name = generator.choice(names)
    at, segment = at_some_time(content, generator)
    values = values_at(at, name)
    column = int(generator.integers(len(values)))
    if abs(values[column]) < NOTICEABLE:
        return False
    limit, limits = values[column] * generator.uniform(0.1, 0.999), statement["limits"][name]
    if name in TOOL_CLAIMS:
        limits[segment] = limit
    else:
        limits[segment][int(limit > 0.0)][column] = limit
    return True


def change_condition(content: Content, generator: np.random.Generator) -> bool:
    """Lower the limit of a condition on the pose of the tool below a value that the trajectory reaches."""
    statement = content["statement"]
    if "tool_pose" not in statement["claims"]:
        return False
    at, segment = at_some_time(content, generator)
    conditions = statement["limits"]["tool_pose"][segment]
    if not conditions:
        return False
    number = int(generator.integers(len(conditions)))
    reached = at.poses(conditions)[number][0][0]
    conditions[number][2] = reached - 10.0 ** generator.uniform(-6, 0)
    return True


def change_line(content: Content, generator: np.random.Generator) -> bool:
    """Lower a limit that depends on the speed below a value that the trajectory reaches at this speed."""
    statement = content["statement"]
    names = [name for name in AT_SPEED_CLAIMS if name in statement["claims"]]
    if not names:
        return False
    name = generator.choice(names)
    at, segment = at_some_time(content, generator)
    values = {"torque_at_speed": at.torques(), "acceleration_at_speed": at.a, "jerk_at_speed": at.j}[name]
    joint = int(generator.integers(len(values)))
    reached, speed = abs(values[joint][0]), abs(at.v[joint][0])
    for line in statement["limits"][name][segment][joint]:
        low, high, _, slope = line
        if low <= speed and (high is None or speed <= high):
            line[2] = reached * generator.uniform(0.1, 0.999) + slope * (speed - low)
    return bool(reached > NOTICEABLE)


def change_force(content: Content, generator: np.random.Generator) -> bool:
    """Let the tool exert a moment beyond the torque limit of the last joint, about its axis."""
    statement = content["statement"]
    if "torque" not in statement["claims"]:
        return False
    at, segment = at_some_time(content, generator)
    robot, joint = statement["robots"][statement["robot_of_segment"][segment]], len(at.links) - 1
    side = int(generator.integers(2))
    limit, turns = statement["limits"]["torque"][segment][side][joint], robot["links"][joint]["motion"] == "revolute"
    if limit is None or robot["tool"]["joint"] != joint + 1:
        return False
    wrench = [[0.0] * 3, [0.0] * 3]
    more = (abs(limit) + abs(at.torques()[joint][0])) * generator.uniform(1.01, 10.0)
    held = robot["process_force"]
    wrench[int(turns)][2] = (2 * side - 1) * (more + sum(abs(x) for part in held[1:] for x in part) * 10.0)
    robot["process_force"] = [joint + 1, *wrench]
    return True


def change_drive(content: Content, generator: np.random.Generator) -> bool:
    """Give a moving joint a friction beyond its torque limit."""
    statement = content["statement"]
    if "torque" not in statement["claims"]:
        return False
    at, segment = at_some_time(content, generator)
    lower, upper = statement["limits"]["torque"][segment]
    joint = int(generator.integers(len(upper)))
    limit = (upper if at.v[joint][0] > 0.0 else lower)[joint]
    if limit is None or abs(at.v[joint][0]) < NOTICEABLE:
        return False
    link = statement["robots"][statement["robot_of_segment"][segment]]["links"][joint]
    more = (abs(limit) + abs(at.torques()[joint][0])) * generator.uniform(1.01, 10.0)
    if generator.random() < 0.5:
        link["friction"] += more
    else:
        link["damping"] += more / abs(at.v[joint][0])
    return True


def at_some_time(content: Content, generator: np.random.Generator) -> tuple[Motion, int]:
    """Return the motion of the robot at a random time, and its segment."""
    time = generator.random() * len(content["trajectory"]["lengths"])
    return Proof(content).motion(time, time)


def values_at(at: Motion, name: str) -> list[float]:
    """Return the torques or powers of the joints, or the rate of the tool, at one time."""
    if name in TOOL_CLAIMS:
        return [at.tool_squares()[name][0] ** 0.5]
    torques = [torque[0] for torque in at.torques()]
    powers = [torque * v[0] for torque, v in zip(torques, at.v, strict=True)]
    return {"torque": torques, "power": powers, "total_power": [sum(powers)]}[name]
