"""Changes to proof files that make a claim false, or the evidence incomplete, with digests written anew."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.proofs.false_limits import (
    LINES,
    NOTICEABLE,
    Content,
    at_some_time,
    change_bounded_limit,
    change_condition,
    change_curve,
    change_drive,
    change_force,
    change_limit,
    change_line,
)
from planner.proofs.checker import BOUNDED_CLAIMS, CLAIMS, DIGESTED, DISTANCE_CLAIMS, JOINT_CLAIMS, digest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

KEPT_SHARE = 0.8
"""Share of the claims that another honest file keeps."""


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


def change_path(content: Content, generator: np.random.Generator) -> bool:
    """Move a line or a circle, or the shares of it at which the tool is said to be."""
    if "path_deviation" not in content["statement"]["claims"]:
        return False
    evidence, segments = content["evidence"], content["trajectory"]["segments"]
    guided = [k for k, shares in enumerate(evidence["along"]) if isinstance(shares, list)]
    if not guided:
        return False
    number = guided[int(generator.integers(len(guided)))]
    path = content["statement"]["limits"]["path_deviation"][segments[int(evidence["bounded"][number])]]
    guide = path["guides"][evidence["along"][number][0]]
    kind = generator.choice(["origin", "tool", "shares", "blend"])
    if kind == "blend":
        evidence["along"][number] = len(path["blends"])
    elif kind == "shares":
        evidence["along"][number][1] += generator.choice([-1.0, 1.0]) * 10.0 ** generator.uniform(0.1, 2)
    else:
        moved = guide["tool"]["translation"] if kind == "tool" else guide["links"][0]["origin"]
        away = NOTICEABLE * 10.0 ** generator.uniform(0, 2)
        moved[int(generator.integers(3))] += 2.1 * path["tolerance"][0] ** 0.5 + away
    return True


def change_object(content: Content, generator: np.random.Generator) -> bool:
    """Put an object where a shape of the robot is at some time."""
    statement = content["statement"]
    if "clearance" not in statement["claims"]:
        return False
    at, segment = at_some_time(content, generator)
    scene = statement["scenes"][statement["scene_of_segment"][segment]]
    first, second, _ = scene["clearance"][int(generator.integers(len(scene["clearance"])))]
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
    nodes = [node for name in DISTANCE_CLAIMS for node in evidence[name]]
    if nodes and generator.random() < 0.5:
        node = nodes[int(generator.integers(len(nodes)))]
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
    nodes = [node for name in DISTANCE_CLAIMS for node in content["evidence"][name]]
    planes = [plane for node in nodes for plane in node[2] if isinstance(plane[1], list)]
    if not planes:
        return False
    plane = planes[int(generator.integers(len(planes)))]
    plane[1] = [-x for x in plane[1]]
    return True


def change_size(content: Content, generator: np.random.Generator) -> bool:
    """Make a shape or the margin of a pair so large that they overlap."""
    statement = content["statement"]
    if "clearance" not in statement["claims"]:
        return False
    scene = statement["scenes"][statement["scene_of_segment"][0]]
    pair = scene["clearance"][int(generator.integers(len(scene["clearance"])))]
    if generator.random() < 0.5:
        pair[2] += 10.0 ** generator.uniform(1, 3)
    else:
        scene["shapes"][pair[1]]["ball"] += 10.0 ** generator.uniform(1, 3)
    return True


def change_zone(content: Content, generator: np.random.Generator) -> bool:
    """Widen a speed zone to the whole cell, and lower its speed below that of the tool."""
    statement = content["statement"]
    if "speed_zones" not in statement["claims"]:
        return False
    at, segment = at_some_time(content, generator)
    speed = at.tool_squares()["tcp_linear_velocity"][0] ** 0.5
    pairs = statement["scenes"][statement["scene_of_segment"][segment]]["speed_zones"]
    if not pairs or speed < NOTICEABLE:
        return False
    pairs[int(generator.integers(len(pairs)))][2:] = [1e3, speed * generator.uniform(0.1, 0.999)]
    return True


def change_pose(content: Content, generator: np.random.Generator) -> bool:
    """Move or turn the pose of a waypoint, or move the tool that meets it."""
    statement = content["statement"]
    poses = [waypoint for waypoint in statement["waypoints"] if waypoint["tool_pose"]]
    if not poses:
        return False
    waypoint = poses[int(generator.integers(len(poses)))]
    pose, tool = waypoint["tool_pose"], statement["robots"][waypoint["robot"]]["tool"]
    near, *turned = pose
    kind = generator.choice(["pose", "tool", "rotation"])
    if kind == "rotation" and turned:
        angle = float(generator.uniform(0.1, 1.0))
        turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        rotation = np.array([row[0] for row in turned[0][1]]).reshape(3, 3) @ turn
        for row, entry in zip(turned[0][1], rotation.ravel().tolist(), strict=True):
            row[0] = entry
        return True
    moved = near[2] ** 0.5 + NOTICEABLE * 10.0 ** generator.uniform(0, 2)
    if kind == "tool":
        tool["translation"][int(generator.integers(3))] += 2.0 * moved
    else:
        near[1][int(generator.integers(3))][0] += 2.0 * moved
    return True


def change_end(content: Content, generator: np.random.Generator) -> bool:
    """Change the motion before the start or after the end in a derivative that is claimed to be continuous."""
    statement = content["statement"]
    end = statement["ends"][generator.choice(["initial", "final"])]
    order = int(generator.integers(statement["continuity"] + 1))
    joint = int(generator.integers(len(end[order])))
    largest = max(sum(abs(x) for x in row) for piece in content["trajectory"]["coefficients"] for row in piece)
    end[order][joint] += generator.choice([-1.0, 1.0]) * 10.0 ** generator.uniform(-2, 1) * max(1.0, largest)
    return True


def change_claims(content: Content, generator: np.random.Generator) -> bool:
    """Add a claim for which the file has no limits or shapes."""
    claims = content["statement"]["claims"]
    missing = sorted(set(CLAIMS) - set(claims))
    if missing:
        claims.append(str(generator.choice(missing)))
    return bool(missing)


def change_rational(content: Content, generator: np.random.Generator) -> bool:
    """Change any number of the file, by its last bit or by much, and keep the digests."""
    changed = with_any_number_changed(content, generator)
    is_other = any(digest(changed[name]) != content["digests"][name] for name in DIGESTED)
    content |= {name: changed[name] for name in DIGESTED}
    return is_other


KINDS: tuple[Callable[[Content, np.random.Generator], bool], ...] = (
    change_coefficient,
    change_limit,
    change_curve,
    change_bounded_limit,
    change_object,
    change_size,
    change_zone,
    change_duration,
    change_arrival,
    change_waypoint,
    change_pose,
    change_end,
    change_claims,
    change_path,
    change_condition,
    change_line,
    change_force,
    change_drive,
    change_interval,
    change_plane,
    change_rational,
)
"""Changes after which a claim is false or lacks evidence; each returns whether it could be made."""

KEEP_DIGESTS = (change_rational,)
"""Changes after which the digests stay as they were."""


def tampered(
    content: Content, generator: np.random.Generator, count: int, first: int = 0
) -> Iterator[tuple[str, Content]]:
    """Yield as many tampered files as wanted, each with the kind of its change; `first` is tried first."""
    made, tried = 0, first
    while made < count:
        kind = KINDS[tried % len(KINDS)]
        tried += 1
        changed = copy.deepcopy(content)
        if kind(changed, generator):
            made += 1
            yield kind.__name__, changed if kind in KEEP_DIGESTS else with_digests(changed)


def loosened(content: Content, generator: np.random.Generator) -> Content:
    """Return another honest file: fewer claims, wider limits and smaller margins."""
    changed = copy.deepcopy(content)
    statement = changed["statement"]
    kept = [name for name in statement["claims"] if generator.random() < KEPT_SHARE]
    statement["not_covered"] += sorted(set(statement["claims"]) - set(kept))
    statement["claims"] = kept
    limited = [name for name in (*JOINT_CLAIMS, *BOUNDED_CLAIMS) if name not in LINES]
    for rows in (statement["limits"].get(name, []) for name in limited):
        for segment, row in enumerate(rows):
            if isinstance(row, list):
                for sign, side in zip((-1.0, 1.0), row, strict=True):
                    side[:] = [x if x is None else x + sign * abs(x) * generator.random() for x in side]
            elif row is not None:
                rows[segment] = row * (1.0 + generator.random())
    for pair in (pair for scene in statement["scenes"] for name in DISTANCE_CLAIMS for pair in scene[name]):
        pair[2] -= NOTICEABLE * generator.random()
        pair[3:] = [speed * (1.0 + generator.random()) for speed in pair[3:]]
    return with_digests(changed)


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
