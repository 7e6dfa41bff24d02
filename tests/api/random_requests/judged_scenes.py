"""The judge of scenes: reported clearances and collisions agree with distances of dense samples."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tests.api.random_requests.answered import Answered
from tests.api.random_requests.distances import CLOSED_FORMS
from tests.api.random_requests.handled import stages
from tests.api.random_requests.judged_limits import limits_hold
from tests.api.random_requests.surroundings import Surroundings

if TYPE_CHECKING:
    from planner.robots import Robot

CONTACT = 1.1e-5
"""Permitted shortfall of a margin, m: the value in docs/collisions.md plus rounding."""

GENEROUS = 2e-3
"""Room beyond the margin above which no plan may be refused, m."""

ROUNDING = 1e-6
"""Relative rounding error permitted in an answer."""

ZONE_SAMPLES = 60
"""Number of times at which speeds near objects are checked."""

RESTING = [0.0, 1.0]


def speeds_hold(robot: Robot, request: dict[str, Any], answer: dict[str, Any], checks: Any) -> None:
    """Fail where a sample contradicts the reported speeds of a trajectory near objects."""
    zones = request.get("speed_zones") or []
    assert len(checks or []) == len(zones)
    trajectory = Answered(answer["polynomials"])
    for first, last, around in stages(robot, request, answer) if zones else []:
        ends = np.clip([first, last], *trajectory.breakpoints[[0, -1]])
        if ends[0] == ends[1]:  # what is put down where the trajectory ends is near for no time
            continue
        for zone, check in zip(zones, checks, strict=True):
            speed_holds(around, zone, check, trajectory, ends)


def is_free(robot: Robot, request: dict[str, Any], answer: dict[str, Any], clearance: Any) -> None:
    """Fail where a trajectory reported as collision-free violates a margin."""
    if not request.get("scene") and not request.get("self_collision"):
        return
    trajectory = Answered(answer["polynomials"])
    taken = {take["id"] for waypoint in request.get("waypoints", []) for take in waypoint.get("attach", [])}
    for first, last, around in stages(robot, request, answer):
        ends = np.clip([first, last], *trajectory.breakpoints[[0, -1]])
        for kind, touching in (("scene", False), ("contacts", True)):
            excess, apart, pair = around.least_excess(trajectory, ends, touching=touching)
            assert excess >= -CONTACT, f"{pair} are {-excess} m too near"
            if clearance is not None and clearance[kind] is not None:
                lower = clearance[kind]["lower"]
                assert lower <= apart + 1e-6 or np.isinf(apart), f"{pair} are {apart} m apart, not {lower}"
        excess, apart, pair = around.least_beside_moving(trajectory, ends, taken)
        assert excess >= -CONTACT, f"{pair} are {-excess} m too near while it moves"
        if clearance is not None and clearance["scene"] is not None and apart < np.inf:
            assert clearance["scene"]["lower"] <= apart + 1e-6, f"{pair} are {apart} m apart while it moves"
    if clearance is None:
        return
    if clearance["itself"] is not None:
        sources = {"model", "estimate"} if request.get("self_collision") else {"model"}
        apart, pair = around.least_between_links(trajectory, sources)
        assert apart >= -CONTACT, f"{pair} overlap by {-apart} m"
        assert clearance["itself"]["lower"] <= apart + 1e-6, f"{pair} are {apart} m apart"


def speed_holds(
    around: Surroundings, zone: dict[str, Any], check: dict[str, Any], trajectory: Answered, ends: np.ndarray
) -> None:
    """Fail where a body point exceeds its reported speed in a zone, at times between two (2,), s."""
    assert (check["clearance"], check["limit"]) == (zone["clearance"], zone["speed"])
    assert check["lower"] <= check["peak"]
    assert check["satisfied"] == (check["ratio"] <= 1.0 + ROUNDING) == (not check["exceeded"])
    times = np.linspace(*ends, ZONE_SAMPLES)
    positions, velocities = trajectory.at(times, 2)
    near = np.zeros(len(times), dtype=bool)
    for body in (body for body in around.bodies if body.joint and body.is_line):
        for thing in (thing for thing in around.things if thing.kind in CLOSED_FORMS):
            counts = zone.get("objects") is None or thing.name in zone["objects"]
            if counts and frozenset((body.name, thing.name)) not in around.allowed:
                near |= around.apart(body, thing, positions) < zone["clearance"] - CONTACT
    assert _within(times[near], check["intervals"]).all(), "the robot is near at other times, too"
    speeds = around.speeds(positions[near], velocities[near])
    assert speeds.max(initial=0.0) <= check["peak"] * (1.0 + ROUNDING), f"{speeds.max()} m/s, not {check['peak']}"
    too_fast = speeds > zone["speed"] * (1.0 + ROUNDING)
    assert _within(times[near][too_fast], check["exceeded"]).all(), "the robot is too fast at other times, too"


def _within(times: np.ndarray, intervals: list[list[float]]) -> np.ndarray:
    """Tell whether times (N,) are in any of some intervals, up to rounding."""
    edges = np.array(intervals).reshape(-1, 2)
    inside: np.ndarray = (times[:, None] >= edges[:, 0] - CONTACT) & (times[:, None] <= edges[:, 1] + CONTACT)
    return inside.any(axis=1)


def collides(robot: Robot, request: dict[str, Any], found: dict[str, Any], joint_position: np.ndarray | None) -> None:
    """Fail where a reported collision at a joint position clearly does not exist."""
    around = Surroundings(robot, request)
    names = {body.name for body in around.bodies} | {thing.name for thing in around.things}
    names |= {thing.name for thing, _, _ in around.moving}
    assert set(found["pair"]) <= names, "nothing has these names"
    assert found["detail"]
    if found["code"] == "clearance_unproved":
        return
    assert found["depth"] > 0.0
    assert (found.get("time") or 0.0) >= 0.0
    bodies = [body for body in around.bodies if body.name in found["pair"] and body.is_line and body.joint]
    things = [thing for thing in around.things if thing.name in found["pair"] and thing.kind in CLOSED_FORMS]
    if joint_position is None or len({thing.name for thing in around.things}) < len(around.things):
        return
    of_pair = [body for body in around.bodies if body.name in found["pair"]]
    if things and len(bodies) == len(of_pair) > 0:
        rooms = [
            around.apart(body, thing, joint_position[None])[0] - max(body.margin, thing.margin)
            for body in bodies
            for thing in things
        ]
        assert min(rooms) < GENEROUS, f"{found['pair']} have {min(rooms)} m more than they need"


def validation_holds(
    robot: Robot, request: dict[str, Any], answer: dict[str, Any], random: np.random.Generator
) -> None:
    """Check statements about a trajectory against dense samples, for limits and for distances."""
    polynomials = {"polynomials": request["polynomials"], "satisfied": answer["satisfied"]}
    if answer["satisfied"]:
        limits_hold(robot, request, {"certificate": answer, **polynomials}, random)
    if collision := answer.get("collision"):
        assert not answer["satisfied"]
        joint_position = Answered(request["polynomials"]).at(np.array([collision["time"] or 0.0]))[0][0]
        collides(robot, request, collision, joint_position)
    else:
        is_free(robot, request, polynomials, answer.get("clearance"))
    speeds_hold(robot, request, polynomials, answer.get("speed_zones"))
    assert answer["satisfied"] <= all(check["satisfied"] for check in answer.get("speed_zones") or [])


def check_holds(robot: Robot, request: dict[str, Any], answer: dict[str, Any]) -> None:
    """Compare the answer of a collision check with distances of dense samples."""
    results = answer["results"]
    assert answer["free"] == all(result["free"] for result in results)
    if "positions" in request:
        motions = [at_rest(robot, row) for row in request["positions"]]
    elif "polynomials" in request:
        motions = [request["polynomials"]]
    else:
        motions = [_interpolated(robot, request["samples"])]
    assert len(results) == len(motions)
    for result, motion in zip(results, motions, strict=True):
        assert result["free"] == (result["collision"] is None)
        speeds_hold(robot, request, {"polynomials": motion}, result.get("speed_zones"))
        if result["free"]:
            is_free(robot, request, {"polynomials": motion}, result["clearance"])
        else:
            time = result["collision"]["time"]
            joint_position = Answered(motion).at(np.array([time or 0.0]))[0][0]
            collides(robot, request, result["collision"], joint_position)


def at_rest(robot: Robot, position: list[float]) -> list[dict[str, Any]]:
    """Return polynomials of a robot at rest."""
    pairs = zip(robot.joint_names, position, strict=True)
    return [{"joint": name, "breakpoints": RESTING, "coefficients": [[value]]} for name, value in pairs]


def _interpolated(robot: Robot, samples: dict[str, Any]) -> list[dict[str, Any]]:
    """Return a controller's interpolation of samples: straight lines, or Hermite cubics where velocities are given."""
    time, q = np.array(samples["time"]), np.array(samples["position"])
    h, rise = np.diff(time)[:, None], np.diff(q, axis=0)
    if "velocity" in samples:
        v = np.array(samples["velocity"])
        second = 3.0 * rise / h**2 - (2.0 * v[:-1] + v[1:]) / h
        third = -2.0 * rise / h**3 + (v[:-1] + v[1:]) / h**2
        rows = np.stack([q[:-1], v[:-1], second, third], axis=-1)
    else:
        rows = np.stack([q[:-1], rise / h], axis=-1)
    return [
        {"joint": name, "breakpoints": time.tolist(), "coefficients": rows[:, k].tolist()}
        for k, name in enumerate(robot.joint_names)
    ]
