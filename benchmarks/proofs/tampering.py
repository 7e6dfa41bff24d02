"""Changes to proof files that make a claim false, or the evidence incomplete, with digests written anew."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.proofs.checker import DIGESTED, JOINT_CLAIMS, Motion, Proof, digest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

Content = dict[str, Any]

NOTICEABLE = 1e-3
"""Smallest change of a position that a tampered file has, rad or m."""


def with_digests(content: Content) -> Content:
    """Write the digests anew, as a forger would."""
    content["digests"] = {name: digest(content[name]) for name in DIGESTED}
    return content


def positions(content: Content, piece: int, time: float) -> np.ndarray:
    """Evaluate the joints (joints,) on a piece at a time since its start, rad or m."""
    rows = np.array(content["trajectory"]["coefficients"][piece])
    return np.array(rows @ time ** np.arange(rows.shape[1]))


def change_coefficient(content: Content, generator: np.random.Generator) -> bool:
    """Move the end of a piece, or the start of the first: the position jumps."""
    motion = content["trajectory"]
    piece = int(generator.integers(len(motion["lengths"])))
    row = motion["coefficients"][piece][int(generator.integers(len(motion["coefficients"][piece])))]
    k = int(generator.integers(len(row)))
    row[k] += generator.choice([-1.0, 1.0]) * 10.0 ** generator.uniform(-3, 0) / motion["lengths"][piece] ** k
    return True


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


def change_bounded_limit(content: Content, generator: np.random.Generator) -> bool:
    """Lower a limit of torque or of the tool below a value that the trajectory reaches."""
    statement, motion = content["statement"], content["trajectory"]
    names = [name for name in ("torque", "tcp_linear_velocity", "tcp_angular_velocity") if name in statement["claims"]]
    if not names:
        return False
    name = generator.choice(names)
    time = generator.random() * len(motion["lengths"])
    at, segment = Proof(content).motion(time, time)
    values = tool_or_torque(at, name)
    column = int(generator.integers(len(values)))
    if abs(values[column]) < NOTICEABLE:
        return False
    limit = values[column] * generator.uniform(0.1, 0.999)
    if name == "torque":
        statement["limits"][name][segment][int(limit > 0.0)][column] = limit
    else:
        statement["limits"][name][segment] = limit
    return True


def tool_or_torque(at: Motion, name: str) -> list[float]:
    """Return the torques of the joints, or the rate of the tool, at one time."""
    if name == "torque":
        return [torque[0] for torque in at.torques()]
    return [at.tool_squares()[name][0] ** 0.5]


def change_object(content: Content, generator: np.random.Generator) -> bool:
    """Put an object where a shape of the robot is at some time."""
    statement, motion = content["statement"], content["trajectory"]
    if "clearance" not in statement["claims"]:
        return False
    time = generator.random() * len(motion["lengths"])
    at, segment = Proof(content).motion(time, time)
    scene = statement["scenes"][statement["scene_of_segment"][segment]]
    first, second, _ = scene["pairs"][int(generator.integers(len(scene["pairs"])))]
    standing, moving = scene["shapes"][first], scene["shapes"][second]
    if standing["joint"] > 0:
        return False
    rows, origin = at.frames(0)[moving["joint"]]
    middle = np.mean(moving["points"], axis=0)
    there = np.array([[x[0] for x in row] for row in rows]) @ middle + [x[0] for x in origin]
    if "offset" in standing:
        standing["offset"] = float(np.dot(standing["normal"], there)) + NOTICEABLE
    else:
        shift = there - np.mean(standing["points"], axis=0)
        standing["points"] = (np.array(standing["points"]) + shift).tolist()
    return True


def change_duration(content: Content, generator: np.random.Generator) -> bool:
    """Change the duration of a piece on which the robot moves."""
    lengths = content["trajectory"]["lengths"]
    piece = int(generator.integers(len(lengths)))
    factor = generator.choice([generator.uniform(0.3, 0.99), generator.uniform(1.01, 2.0)])
    before = positions(content, piece, lengths[piece])
    lengths[piece] *= factor
    return bool(np.abs(positions(content, piece, lengths[piece]) - before).max() > NOTICEABLE)


def change_arrival(content: Content, generator: np.random.Generator) -> bool:
    """Change the time of a waypoint to one at which the robot is elsewhere."""
    lengths, waypoints = content["trajectory"]["lengths"], content["statement"]["waypoints"]
    waypoint = waypoints[int(generator.integers(len(waypoints)))]
    time = generator.random() * sum(lengths)
    waypoint["time"] = time
    begins = np.cumsum([0.0, *lengths[:-1]])
    piece = int(np.searchsorted(begins, time, side="right")) - 1
    there = positions(content, piece, time - begins[piece])
    return waypoint["position"] is not None and bool(np.abs(there - waypoint["position"]).max() > NOTICEABLE)


def change_waypoint(content: Content, generator: np.random.Generator) -> bool:
    """Change the position of a waypoint."""
    waypoints = content["statement"]["waypoints"]
    position = waypoints[int(generator.integers(len(waypoints)))]["position"]
    if position is None:
        return False
    position[int(generator.integers(len(position)))] += generator.choice([-1.0, 1.0]) * 10.0 ** generator.uniform(-5, 0)
    return True


def change_interval(content: Content, generator: np.random.Generator) -> bool:
    """Leave a part of the time without evidence."""
    evidence = content["evidence"]
    if evidence["clearance"] and generator.random() < 0.5:
        node = evidence["clearance"][int(generator.integers(len(evidence["clearance"])))]
        if generator.random() < 0.5:
            node[2].pop(int(generator.integers(len(node[2]))))
        else:
            node[0] += (node[1] - node[0]) * 2.0 ** -float(generator.integers(1, 6))
    elif evidence["bounded"]:
        evidence["bounded"].pop(int(generator.choice([0, -1])))
    else:
        return False
    return True


def change_plane(content: Content, generator: np.random.Generator) -> bool:
    """Turn the normal of a plane round."""
    planes = [plane for node in content["evidence"]["clearance"] for plane in node[2] if plane[1] is not None]
    if not planes:
        return False
    plane = planes[int(generator.integers(len(planes)))]
    plane[1] = [-x for x in plane[1]]
    return True


KINDS: tuple[Callable[[Content, np.random.Generator], bool], ...] = (
    change_coefficient,
    change_limit,
    change_bounded_limit,
    change_object,
    change_duration,
    change_arrival,
    change_waypoint,
    change_interval,
    change_plane,
)
"""Changes after which a claim is false or lacks evidence; each returns whether it could be made."""


def tampered(content: Content, generator: np.random.Generator, count: int) -> Iterator[tuple[str, Content]]:
    """Yield as many tampered files as wanted, each with the kind of its change."""
    made = tried = 0
    while made < count:
        kind = KINDS[tried % len(KINDS)]
        tried += 1
        changed = copy.deepcopy(content)
        if kind(changed, generator):
            made += 1
            yield kind.__name__, with_digests(changed)


def numbers_of(value: Any) -> Iterator[tuple[Any, Any]]:
    """Yield each list or object with a number in it, and the index or key of the number."""
    for key, each in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        if isinstance(each, float | int):
            yield value, key
        else:
            yield from numbers_of(each)


def with_any_number_changed(content: Content, generator: np.random.Generator) -> Content:
    """Change any number of the file, by its last bit or by much; the claims may still be true."""
    changed = copy.deepcopy(content)
    found = list(numbers_of({name: changed[name] for name in DIGESTED}))
    where, key = found[int(generator.integers(len(found)))]
    factor = generator.choice([0.0, -1.0, 0.5, 1.1, 2.0, 1e6])
    where[key] = float(np.nextafter(where[key], np.inf)) if generator.random() < 0.5 else where[key] * float(factor)
    return changed
