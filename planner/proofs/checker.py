"""The stand-alone checker of proof files (`docs/proof.md`), which trusts no number of a file and no other code."""

from __future__ import annotations

import hashlib
import json
import math
import struct
import sys
from bisect import bisect_right
from fractions import Fraction
from functools import cached_property
from itertools import accumulate, chain, pairwise, product, zip_longest
from operator import add, mul
from pathlib import Path
from typing import Any

Model = tuple[float, ...]  # f on [-1, 1]: six coefficients of a polynomial p, and r with |f(x) - p(x)| <= r
Vector = list[Model]  # three coordinates
Values = dict[str, Any]  # a JSON object
FORMAT = "planner-proof/4"
"""Name and version of the format."""
DIGESTED = ("statement", "trajectory", "evidence")
"""Parts of a file that have a digest."""
MOST_BYTES_OF_PROOF = 100_000_000
"""Largest size of a file."""
JOINT_CLAIMS = ("position", "velocity", "acceleration", "jerk")
"""Claims about the joints, by the order of the derivative."""
TOOL_CLAIMS = ("tcp_linear_velocity", "tcp_angular_velocity", "tcp_linear_acceleration", "tcp_angular_acceleration")
"""Claims about the motion of the tool."""
AT_SPEED_CLAIMS = ("torque_at_speed", "acceleration_at_speed", "jerk_at_speed")
"""Claims with limits that depend on the speed of the joint."""
BOUNDED_CLAIMS = ("torque", "power", "total_power", *AT_SPEED_CLAIMS, *TOOL_CLAIMS, "path_deviation", "tool_pose")
"""Claims that Taylor models prove on the intervals under `bounded`."""
DISTANCE_CLAIMS = ("clearance", "speed_zones")
"""Claims about pairs of shapes: they are apart, or the robot is slow."""
CLAIMS = ("continuity", "waypoints", *JOINT_CLAIMS, "velocity_at_position", *BOUNDED_CLAIMS, *DISTANCE_CLAIMS)
"""All claims of the format."""
EXACT_EXCESS = Fraction(1, 10**9)
"""Relative excess over limits of joints, and velocity at which friction has no sign, that count as rounding."""
BOUNDED_EXCESS = 1e-6
"""Relative excess over limits of torque, power, tool and path, and distance of a joint from its waypoint."""
CONTACT = 1e-5
"""Distance, m, by which a pair of shapes may be below its margin."""
UNIT = 2.0**-53
"""Relative rounding error of one operation."""
UP = 1.0 + 1e-13
"""Factor beyond the rounding of a sum of some hundred magnitudes."""
ZERO: Model = (0.0,) * 7
"""Taylor model of the number 0."""
ONE: Model = (1.0, *ZERO[1:])
"""Taylor model of the number 1."""
WITHIN: Model = (*ZERO[1:], 1.0)
"""Taylor model of any function between -1 and 1."""


class ProofRejected(Exception):
    """A claim of the file is not proved."""


def require(condition: bool, message: str) -> None:
    """Reject the file unless a condition holds."""
    if not condition:
        raise ProofRejected(message)


def encoded(value: Any) -> bytes:
    """Encode a JSON value independently of spaces, of the order of keys and of how its numbers are written."""
    if isinstance(value, int | float):
        require(math.isfinite(value) and not isinstance(value, bool), "a value is no finite number")
        return b"n" + struct.pack(">d", float(value) + 0.0)
    if isinstance(value, str):
        return b"s%d:%b" % (len(value.encode()), value.encode())
    if isinstance(value, list):
        return b"[" + b"".join(map(encoded, value)) + b"]"
    if value is None:
        return b"z"
    return b"{" + b"".join(encoded(key) + encoded(value[key]) for key in sorted(value)) + b"}"


def digest(value: Any) -> str:
    """Compute the SHA-256 digest of a JSON value."""
    return hashlib.sha256(encoded(value)).hexdigest()


def index(value: Any, count: int) -> int:
    """Read a number from 0 to `count` - 1."""
    require(isinstance(value, int | float) and 0 <= value < count and value == int(value), "an index is out of range")
    return int(value)


def numbers(values: Any, count: int) -> list[float]:
    """Read a list of numbers."""
    require([isinstance(x, int | float) for x in list(values)] == [True] * count, "a list of numbers is malformed")
    return list(map(float, values))


def _object(pairs: list[tuple[str, Any]]) -> Values:
    require(len(dict(pairs)) == len(pairs), "a key stands twice")
    return dict(pairs)


def bernstein(coefficients: list[Fraction]) -> tuple[list[int], int]:
    """Return Bernstein coefficients on [0, 1], between whose extremes the polynomial lies, and their denominator."""
    n = len(coefficients) - 1
    binomials = [math.comb(n, k) for k in range(n + 1)]
    common = math.lcm(*(c.denominator for c in coefficients)) * math.lcm(*binomials)
    whole = [c.numerator * (common // (c.denominator * b)) for c, b in zip(coefficients, binomials, strict=True)]
    return [sum(math.comb(i, k) * whole[k] for k in range(i + 1)) for i in range(n + 1)], common


def is_one_nonnegative(*polynomials: list[Fraction]) -> bool:
    """Tell whether at each u of [0, 1] at least one of some polynomials is not negative."""
    waiting = [([bernstein(each)[0] for each in polynomials], 0)]
    while waiting:
        rows, depth = waiting.pop()
        if any(min(row) >= 0 for row in rows):
            continue
        if all(row[0] < 0 for row in rows) or all(row[-1] < 0 for row in rows) or depth == 80:
            return False
        levels = [[*accumulate(row[1:], lambda x, _: [*map(add, x, x[1:])], initial=row)] for row in rows]
        waiting.append(([[x[0] << len(x) - 1 for x in level] for level in levels], depth + 1))
        waiting.append(([[x[-1] << len(x) - 1 for x in level[::-1]] for level in levels], depth + 1))
    return True


def model(coefficients: list[float]) -> Model:
    """Return the Taylor model on [-1, 1] of a polynomial with coefficients that are rounded once."""
    kept = coefficients[:6] + [0.0] * (6 - len(coefficients))
    return (*kept, (UNIT * sum(map(abs, kept)) + sum(map(abs, coefficients[6:])) + 1e-300) * UP)


def combine(weights: list[float], models: list[Model]) -> Model:
    """Return the sum of Taylor models with weights."""
    terms = [(w, m) for w, m in zip(weights, models, strict=True) if w != 0.0 and m is not ZERO]
    if not terms or (len(terms) == 1 and terms[0][0] == 1.0):
        return terms[0][1] if terms else ZERO
    p = q = x = y = u = v = size = rest = 0.0
    for w, (a, b, c, d, e, f, r) in terms:
        p, q, x, y, u, v = p + w * a, q + w * b, x + w * c, y + w * d, u + w * e, v + w * f
        size += abs(w) * (abs(a) + abs(b) + abs(c) + abs(d) + abs(e) + abs(f))
        rest += abs(w) * r
    return (p, q, x, y, u, v, (rest + (len(terms) + 1) * UNIT * size + 1e-300) * UP)


def _add(*models: Model) -> Model:
    return combine([1.0] * len(models), list(models))


def _constants(values: Any) -> Vector:
    return [(x, *ZERO[1:]) if x != 0.0 else ZERO for x in values]


def multiply(f: Model, g: Model) -> Model:
    """Return the product of two Taylor models; terms beyond degree 5 go to the remainder."""
    if f is ZERO or g is ZERO:
        return ZERO
    a0, a1, a2, a3, a4, a5, ra = f
    b0, b1, b2, b3, b4, b5, rb = g
    t4 = (t5 := abs(b5)) + abs(b4)
    t2 = (t3 := t4 + abs(b3)) + abs(b2)
    size_g = (t1 := t2 + abs(b1)) + abs(b0)
    size_f = abs(a0) + abs(a1) + abs(a2) + abs(a3) + abs(a4) + abs(a5)
    beyond = abs(a1) * t5 + abs(a2) * t4 + abs(a3) * t3 + abs(a4) * t2 + abs(a5) * t1
    rest = beyond + size_f * rb + size_g * ra + ra * rb + 8.0 * UNIT * size_f * size_g
    low = (a0 * b0, a0 * b1 + a1 * b0, a0 * b2 + a1 * b1 + a2 * b0, a0 * b3 + a1 * b2 + a2 * b1 + a3 * b0)
    c4 = a0 * b4 + a1 * b3 + a2 * b2 + a3 * b1 + a4 * b0
    return (*low, c4, a0 * b5 + a1 * b4 + a2 * b3 + a3 * b2 + a4 * b1 + a5 * b0, (rest + 1e-300) * UP)


POWERS = [[Fraction(math.comb(k, j) * (-1) ** (k - j) * 2**j) for j in range(6)] for k in range(6)]
"""Coefficients of (2 u - 1)^k in powers of u."""
TO_BERNSTEIN = [*zip(*([c / common for c in row] for row, common in map(bernstein, POWERS)), strict=True)]
"""Matrix from the coefficients of a Taylor model to its Bernstein coefficients; no entry exceeds 1."""


def upper(f: Model) -> float:
    """Return an upper bound of a Taylor model."""
    rest = (f[6] + 1e-15 * sum(map(abs, f[:6]))) * UP
    peak: float = max(sum(map(mul, row, f)) for row in TO_BERNSTEIN)
    return peak + rest + UNIT * (abs(peak) + rest) * 2.0


def is_below(f: Model, limit: float) -> bool:
    """Tell whether a Taylor model is proved to be at most a limit; a cheap bound comes first."""
    size = abs(f[1]) + abs(f[2]) + abs(f[3]) + abs(f[4]) + abs(f[5]) + f[6]
    return f[0] + size + 1e-14 * (abs(f[0]) + size) <= limit or upper(f) <= limit


def sine_and_cosine(x: float) -> tuple[float, float]:
    """Compute sine and cosine of a number, rounded once, by their series in integers."""
    require(abs(x) <= 64, "a joint turns too far")
    fixed = math.floor(Fraction(x) * 2**256)
    sums, term, k = [0, 0], 1 << 256, 0
    while term not in (0, -1):
        sums[k % 2] += term if k % 4 < 2 else -term
        k += 1
        term = (term * fixed >> 256) // k
    return sums[1] / (1 << 256), sums[0] / (1 << 256)


def turn_of(q: Model) -> tuple[Model, Model]:
    """Return the Taylor models of sine and cosine of a joint position."""
    s0, c0 = ((value, *ZERO[1:6], 2.0 * UNIT) for value in sine_and_cosine(q[0]))
    d: Model = (0.0, *q[1:])
    size = sum(map(abs, d)) * UP
    d2 = multiply(d, d)
    d3, d4 = multiply(d2, d), multiply(d2, d2)
    beyond = size**7 / 5040.0, size**6 / 720.0, UNIT * (size**3 + size**5)  # at last the rounding of 1/6, 1/120, 1/24
    tails = [(0.0,) * 6 + (x * UP,) for x in beyond]
    s = combine([1.0, -1.0 / 6.0, 1.0 / 120.0, 1.0, 1.0], [d, d3, multiply(d4, d), tails[0], tails[2]])
    c = combine([1.0, -0.5, 1.0 / 24.0, 1.0, 1.0], [ONE, d2, d4, tails[1], tails[2]])
    return _add(multiply(s0, c), multiply(c0, s)), combine([1.0, -1.0], [multiply(c0, c), multiply(s0, s)])


def _applied(matrix: Any, vector: Vector) -> Vector:
    return [combine(row, vector) for row in matrix]


def _cross(a: Vector, b: Vector) -> Vector:
    terms = ((multiply(a[i], b[j]), multiply(a[j], b[i])) for i, j in ((1, 2), (2, 0), (0, 1)))
    return [combine([1.0, -1.0], [*pair]) for pair in terms]


def rolled(shape: Values, n: Vector, size: float) -> float:
    """Return an upper bound of the reach along n of a half space, or of a shape beyond its points."""
    if "offset" in shape:
        return float(shape["offset"])
    along = combine(shape["axis"], n) if shape["disc"] else ZERO
    least = max(-upper(combine([-1.0], [along])), -upper(along), 0.0)
    return float(shape["ball"] * size + shape["disc"] * math.sqrt(max(size**2 * UP - least**2, 0.0))) * UP


class Motion:
    """The Taylor models of the joints' positions `q` and their derivatives `v`, `a` and `j` on an interval."""

    def __init__(self, robot: Values, q: Vector, *rates: Vector):
        self.robot, self.links, self.q, (self.v, self.a, self.j) = robot, robot["links"], q, rates or ([], [], [])
        self.tip = index(robot["tool"]["joint"], len(self.links) + 1)
        self.start = index(robot.get("process_force", [0])[0], self.tip + 1)
        self.point = _constants(numbers(robot["tool"]["translation"], 3))
        turning = [link["motion"] == "revolute" for link in self.links]
        self.turns = [turn_of(x) if turns else (ZERO, ONE) for x, turns in zip(q, turning, strict=True)]
        self.known, self.speeds = dict[int, list[tuple[list[Vector], Vector]]](), list[float]()

    def shift(self, k: int) -> Vector:
        """Return the origin of a joint's frame in the frame before."""
        link, slides = self.links[k], float(self.links[k]["motion"] != "revolute")
        rows = zip(link["origin"], link["rotation"], strict=True)
        return [combine([1.0, slides * row[2]], [*_constants([x]), self.q[k]]) for x, row in rows]

    def carry(self, k: int, vector: Any, sign: float) -> Vector:
        """Carry a vector into the frame of a joint (sign -1) or back into the one before (1)."""
        rotation, (sine, cosine) = self.links[k]["rotation"], self.turns[k]
        x, y, z = vector if sign > 0.0 else _applied(zip(*rotation, strict=True), list(vector))
        pairs = ((x, y, -sign), (y, x, sign))
        turned = [*(combine([1.0, s], [multiply(cosine, p), multiply(sine, q)]) for p, q, s in pairs), z]
        return _applied(rotation, turned) if sign > 0.0 else turned

    def frames(self, start: int) -> list[tuple[list[Vector], Vector]]:
        """Compute the frames from `start` on, in the frame `start`."""
        found = [([[ONE, ZERO, ZERO], [ZERO, ONE, ZERO], [ZERO, ZERO, ONE]], [ZERO] * 3)]
        for k in range(start, len(self.links) if start not in self.known else 0):
            rows, origin = found[-1]
            moved = [_add(o, *map(multiply, row, self.shift(k))) for row, o in zip(rows, origin, strict=True)]
            found.append(([self.carry(k, row, -1.0) for row in rows], moved))
        return self.known.setdefault(start, found)

    @cached_property
    def actual(self) -> Motion:
        """The motion at all positions of the joints within their following errors."""
        errors = numbers(self.robot["following_errors"], len(self.q))
        q = [combine([1.0, error], [x, WITHIN]) for x, error in zip(self.q, errors, strict=True)]
        return Motion(self.robot, q, self.v, self.a, self.j) if any(errors) else self

    @cached_property
    def rates(self) -> list[tuple[Vector, Vector, Vector, Vector, Vector]]:
        """Velocity, acceleration, both of the angle, and gravity of each frame, in its own axes."""
        rest = [ZERO] * 3
        found = [(rest, rest, rest, rest, _constants(self.robot["gravity"]))]
        for k, link in enumerate(self.links):
            (v, a, w, dw, g), shift, still = found[-1], self.shift(k), (ZERO, ZERO)
            moved = self.v[k], self.a[k]
            (rate, gain), (speed, push) = (moved, still) if link["motion"] == "revolute" else (still, moved)
            a = self.carry(k, map(_add, a, _cross(dw, shift), _cross(w, _cross(w, shift))), -1.0)
            v, w, dw, g = (self.carry(k, x, -1.0) for x in (map(_add, v, _cross(w, shift)), w, dw, g))
            across = [combine([2.0], [multiply(w[1], speed)]), combine([-2.0], [multiply(w[0], speed)]), push]
            a = list(map(_add, a, across))
            dw = list(map(_add, dw, [multiply(w[1], rate), combine([-1.0], [multiply(w[0], rate)]), gain]))
            found.append(([v[0], v[1], _add(v[2], speed)], a, [w[0], w[1], _add(w[2], rate)], dw, g))
        return found

    def torques(self) -> list[Model]:
        """Compute the torque or force of each joint by the recursive Newton-Euler algorithm."""
        found, force, moment, (_, *wrench) = list[Model](), [ZERO] * 3, [ZERO] * 3, self.robot["process_force"]
        rows, _ = self.frames(self.start)[self.tip - self.start]
        thrust, torsion = ([combine(numbers(x, 3), [*column]) for column in zip(*rows, strict=True)] for x in wrench)
        for k in range(len(self.links) - 1, -1, -1):
            if k + 1 == self.tip:
                moment, force = [*map(_add, moment, torsion, _cross(self.point, thrust))], [*map(_add, force, thrust)]
            link, (_, a, w, dw, g) = self.links[k], self.rates[k + 1]
            center, inertia, mass = _constants(link["center_of_mass"]), link["inertia"], link["mass"]
            gains = zip(a, g, _cross(dw, center), _cross(w, _cross(w, center)), strict=True)
            push = [combine([mass, -mass, mass, mass], [*each]) for each in gains]
            turn = map(_add, _applied(inertia, dw), _cross(w, _applied(inertia, w)), _cross(center, push))
            moment, force = list(map(_add, moment, turn)), list(map(_add, force, push))
            v, own = self.v[k], moment[2] if link["motion"] == "revolute" else force[2]
            ends = -upper(combine([-1.0], [v])), -upper(v)
            low, high = ((x >= -EXACT_EXCESS) + (x >= EXACT_EXCESS) - 1.0 for x in ends)
            sign = ((low - high) / 2.0, *ZERO[1:6], (-low - high) / 2.0)  # which is between low and -high
            drive = link["rotor_inertia"], link["damping"], link["friction"]
            found.append(combine([1.0, *drive], [own, self.a[k], v, sign]))
            force, moment = self.carry(k, force, 1.0), self.carry(k, moment, 1.0)
            moment = list(map(_add, moment, _cross(self.shift(k), force)))
        return found[::-1]

    def tool_squares(self) -> dict[str, Model]:
        """Compute the squares of the tool's velocities and accelerations."""
        (v, a, w, dw, _), point = self.rates[self.tip], self.point
        gains = map(_add, a, _cross(dw, point), _cross(w, _cross(w, point)))
        vectors = zip(TOOL_CLAIMS, map(list, (map(_add, v, _cross(w, point)), w, gains, dw)), strict=True)
        return {name: _add(*map(multiply, x, x)) for name, x in vectors}

    def unproved(self, claims: set[str], limits: Values, segment: int, along: Any) -> set[str]:
        """Return the claims that are not proved here, with the shares `along` of the segment's path."""
        own = {name: limits[name][segment] for name in claims}
        torques = [] if claims.isdisjoint(BOUNDED_CLAIMS[:4]) else self.actual.torques()
        powers = [*map(multiply, torques, self.v)]
        values = {"torque": torques, "power": powers, "total_power": [_add(*powers)]}
        squares = {} if claims.isdisjoint(TOOL_CLAIMS) else self.actual.tool_squares()
        sides = [(x, squares[x], own[x] and own[x] * abs(own[x])) for x in claims & squares.keys()]
        for name in claims & values.keys():
            for sign, row in zip((-1.0, 1.0), own[name], strict=True):
                sides += [(name, combine([sign], [x]), y and sign * y) for x, y in zip(values[name], row, strict=True)]
        for name, rates in zip(AT_SPEED_CLAIMS, (torques, self.a, self.j), strict=True):
            for x, v, lines in zip(rates, self.v, own[name], strict=True) if name in own else ():
                for sign, side, (low, high, most, slope) in product((-1.0, 1.0), (-1.0, 1.0), lines):
                    speed = combine([side], [v])
                    if upper(speed) >= low and (high is None or upper(combine([-1.0], [speed])) >= -high):
                        sides.append((name, combine([sign, slope, -slope * low], [x, speed, ONE]), most))
        known = [(name, x, y + BOUNDED_EXCESS * abs(y)) for name, x, y in sides if y is not None]
        if (path := own.get("path_deviation")) is not None:
            known += [("path_deviation", x, y) for x, y in self.off_path(path, along)]
        known += [("tool_pose", x, y) for x, y in self.poses(own.get("tool_pose", []))]
        return {name for name, x, y in known if not is_below(x, y)}

    def tool(self) -> tuple[Vector, list[Model]]:
        """Compute the position of the tool, and the nine entries of its rotation, row by row."""
        rows, origin = self.frames(0)[self.tip]
        point = [_add(x, *map(multiply, row, self.point)) for row, x in zip(rows, origin, strict=True)]
        return point, [x for row in rows for x in _applied(zip(*self.robot["tool"]["rotation"], strict=True), row)]

    def poses(self, conditions: list[Any]) -> list[tuple[Model, float]]:
        """Return the values of conditions on the pose of the tool, and their limits."""
        pose, found = [ONE, *chain(*self.tool())] if conditions else [], []
        for linear, squared, limit in conditions:
            value, *roots = (combine(numbers(row, len(pose)), pose) for row in (linear, *squared))
            found.append((_add(value, *map(multiply, roots, roots)), numbers([limit], 1)[0]))
        return found

    def off_path(self, path: Values, along: Any) -> list[tuple[Model, float]]:
        """Return the squares of deviations from a path at its shares `along`, or in a blend, and their limits."""
        if not isinstance(along, list):
            return self.poses([path["blends"][index(along, len(path["blends"]))]])
        guide, share = path["guides"][index(along[0], len(path["guides"]))], (*numbers(along[1:], 6), 0.0)
        q = [combine(rates, [*accumulate([share] * len(rates), multiply)]) for rates in guide["rates"]]
        found = [(share, 1.0 + BOUNDED_EXCESS), (combine([-1.0], [share]), BOUNDED_EXCESS)]
        for one, other, limit in zip(self.tool(), Motion(guide, q).tool(), path["tolerance"], strict=False):
            apart = [combine([1.0, -1.0], [*pair]) for pair in zip(one, other, strict=True)]
            found.append((_add(*map(multiply, apart, apart)), numbers([limit], 1)[0]))
        return found

    def top_speed(self, scene: Values) -> float:
        """Return an upper bound of the speeds of a scene's moving shapes and of the tool centre point."""
        tool = {"joint": self.tip, "points": [self.robot["tool"]["translation"]], "disc": 0.0, "ball": 0.0}
        for shape in () if self.speeds else [tool, *(x for x in scene["shapes"] if x["joint"])]:
            (v, _, w, *_), points = self.rates[int(shape["joint"])], shape["points"]
            at = ([combine([1.0, x[i - 1], -x[i - 2]], [v[i], w[i - 2], w[i - 1]]) for i in range(3)] for x in points)
            turning, *speeds = (math.sqrt(max(upper(_add(*map(multiply, x, x))), 0.0)) * UP for x in (w, *at))
            require(math.isfinite(turning + sum(speeds)), "a speed is too large")
            self.speeds.append(max(speeds) + (shape["disc"] + shape["ball"]) * turning * UP)
        return max(self.speeds)

    def is_safe(self, scene: Values, pair: list[Any], normal: Any) -> bool:
        """Tell whether a plane moving with the first shape keeps a pair apart, or the robot is `slow`."""
        if normal == "slow":
            return self.top_speed(scene) <= numbers(pair[3:], 1)[0] * (1.0 + BOUNDED_EXCESS)
        one, other, margin, *_ = pair
        first, second = (scene["shapes"][index(x, len(scene["shapes"]))] for x in (one, other))
        start, end = int(first["joint"]), int(second["joint"])
        require(start <= end and "offset" not in second, "a pair is in the wrong order")
        n = numbers(first["normal"] if "offset" in first else normal, 3)
        size, margin = math.sqrt(sum(x * x for x in n)), margin - CONTACT
        require(0.5 <= size <= 2.0, "a normal has no direction")  # noqa: PLR2004
        rows, origin = self.frames(start)[end - start]
        turned, offset = [combine(n, [*column]) for column in zip(*rows, strict=True)], combine(n, origin)
        far = [sum(map(mul, n, x)) + 1e-14 * size * sum(map(abs, x)) for x in first.get("points", [])]
        parts = [max(far, default=0.0), rolled(first, _constants(n), size), rolled(second, turned, size), margin * size]
        needed = sum(parts) + (UP - 1.0) * sum(map(abs, parts))
        weights = ([-1.0, *(-x for x in point)] for point in second["points"])
        return all(is_below(combine(each, [offset, *turned]), -needed) for each in weights)


class Proof:
    """A proof file, well-formed so far as it is read."""

    def __init__(self, content: Values):
        require(content["format"] == FORMAT, f"the format is not {FORMAT}")
        self.statement, self.trajectory, self.evidence = parts = [content[name] for name in DIGESTED]
        self.digests = dict(zip(DIGESTED, map(digest, parts), strict=True))
        require(content["digests"] == self.digests, "a digest does not match")
        self.claims: list[str] = [*self.statement["claims"]]
        require(len({*self.claims} & {*CLAIMS}) == len(self.claims), "a claim is unknown")
        self.limits, rows = self.statement["limits"], self.trajectory["coefficients"]
        self.pieces, self.joints, order = len(rows), len(rows[0]), len(rows[0][0])
        self.lengths = [Fraction(x) for x in numbers(self.trajectory["lengths"], self.pieces)]
        require(0 < order <= 16 and min(self.lengths) > 0 and {*map(len, rows)} == {self.joints}, "a bad piece")
        self.rows = [[[*map(Fraction, numbers(row, order))] for row in piece] for piece in rows]
        self.begins = list(accumulate(self.lengths, initial=Fraction(0)))
        segments = self.statement["segments"]
        self.segments = [index(x, segments) for x in self.trajectory["segments"]]
        require(self.segments == sorted(self.segments) and len(self.segments) == self.pieces, "segments are malformed")
        self.robots: list[Values] = self.statement["robots"]
        require(all(len(robot["links"]) == self.joints for robot in self.robots), "a robot has other joints")
        scenes = self.statement["scenes"]
        for shape in chain(*(scene["shapes"] for scene in scenes)):
            index(shape["joint"], 1 if "offset" in shape else self.joints + 1)
            if "offset" not in shape:
                size, lengths = math.hypot(*numbers(shape["axis"], 3)), {*map(len, shape["points"])}
                require(abs(size - 1.0) < EXACT_EXCESS and lengths == {3}, "a shape is malformed")
                require(min(numbers([shape["disc"], shape["ball"]], 2)) >= 0.0, "a radius is negative")
        self.robot_of = [index(x, len(self.robots)) for x in self.statement["robot_of_segment"]]
        self.scene_of = [index(x, len(scenes)) for x in self.statement["scene_of_segment"]]
        require(len(self.robot_of) == segments and len(self.scene_of) in (0, segments), "a segment has no robot")
        self.cells = [(i, j, self.segments[i]) for i in range(self.pieces) for j in range(self.joints)]
        rows_of = ((i, j, bernstein(self.derivative(i, j, 0))) for i, j, _ in self.cells)
        self.hulls = {(i, j): [c / common for c in row] for i, j, (row, common) in rows_of}

    def derivative(self, piece: int, joint: int, order: int) -> list[Fraction]:
        """Return a derivative by time of a joint's position on a piece, as a polynomial of u."""
        above, below = self.lengths[piece].as_integer_ratio()
        terms = [(k - order, c * math.perm(k, order)) for k, c in enumerate(self.rows[piece][joint])][order:]
        return [Fraction(c.numerator * above**k, c.denominator * below**k) for k, c in terms] or [Fraction(0)]

    def motion(self, start: float, end: float) -> tuple[Motion, int]:
        """Return the motion between two times, each the number of a piece and a share of it, and its segment."""
        require(0.0 <= min(numbers([start, end], 2)) <= end <= self.pieces, "an interval is out of range")
        first = min(int(start), self.pieces - 1)
        last = max(math.ceil(end) - 1, first)
        segment, robot = self.segments[first], self.robots[self.robot_of[self.segments[first]]]
        if last == first:
            return Motion(robot, *self.models(first, Fraction(start) - first, Fraction(end) - first)), segment
        require(start == first and end == last + 1, "an interval of several pieces ends within one")
        return Motion(robot, [self.chord(j, first, last) for j in range(self.joints)]), segment

    def models(self, piece: int, start: Fraction, end: Fraction) -> tuple[Vector, ...]:
        """Return the Taylor models of positions and their first three derivatives on a part of a piece."""
        middle, half = self.lengths[piece] * (start + end) / 2, self.lengths[piece] * (end - start) / 2
        common, found = math.lcm(middle.denominator, half.denominator), tuple[Vector, ...](([], [], [], []))
        at, wide = int(middle * common), int(half * common)
        for row in self.rows[piece]:
            n, scale = len(row) - 1, math.lcm(*(c.denominator for c in row))
            whole = [(i, int(c * scale) * common ** (n - i)) for i, c in enumerate(row)]
            taylor = [sum(c * math.comb(i, k) * at ** (i - k) for i, c in whole[k:]) for k in range(n + 1)]
            for order, into in enumerate(found):
                terms = (math.perm(k, order) * taylor[k] * wide ** (k - order) for k in range(order, n + 1))
                into.append(model([x / (scale * common ** (n - order)) for x in terms]))
        return found

    def chord(self, joint: int, first: int, last: int) -> Model:
        """Return the Taylor model of a joint's position on several pieces: a straight line and its largest error."""
        hulls = [self.hulls[piece, joint] for piece in range(first, last + 1)]
        begin, *_, end = ends = self.begins[first : last + 2]
        times = [float((time - begin) / (end - begin)) for time in ends]
        low, rise, n = hulls[0][0], hulls[-1][-1] - hulls[0][0], len(hulls[0])
        spans = [one + (two - one) * (k / max(n - 1, 1)) for one, two in pairwise(times) for k in range(n)]
        error = max(abs(c - low - rise * t) for c, t in zip(chain(*hulls), spans, strict=True))
        error += 1e-14 * max(map(abs, chain(*hulls))) + 1e-300
        return (low + rise / 2.0, rise / 2.0, *ZERO[2:6], error)

    def check_continuity(self) -> None:
        """Check that derivatives up to the claimed order do not jump, from and to the motion at the ends."""
        for order in range(index(self.statement["continuity"], 5) + 1):
            rows = [[self.derivative(i, j, order) for j in range(self.joints)] for i in range(self.pieces)]
            largest = max(Fraction(max(map(abs, b)), common) for piece in rows for b, common in map(bernstein, piece))
            ends = (numbers(self.statement["ends"][name][order], self.joints) for name in ("initial", "final"))
            before, after = ([[Fraction(x)] for x in end] for end in ends)
            pairs = chain(*(zip(*each, strict=True) for each in pairwise([before, *rows, after])))
            require(max(abs(sum(a, Fraction(0)) - b[0]) for a, b in pairs) * 10**7 <= largest, "a derivative jumps")

    def check_waypoints(self) -> None:
        """Check that joints and tool are where they are to be at the times of the waypoints."""
        waypoints = self.statement["waypoints"]
        times = [Fraction(x) for x in numbers([waypoint["time"] for waypoint in waypoints], len(waypoints))]
        ends = (Fraction(0), *times, self.begins[-1] * (1 + EXACT_EXCESS))
        require(all(a <= b for a, b in pairwise(ends)), "the times of the waypoints are out of order")
        for time, waypoint in zip(times, waypoints, strict=True):
            piece = bisect_right(self.begins, time, 0, self.pieces) - 1
            share = min((time - self.begins[piece]) / self.lengths[piece], Fraction(1))
            robot = self.robots[index(waypoint["robot"], len(self.robots))]
            motion = Motion(robot, *self.models(piece, share, share))
            if waypoint["position"] is not None:
                pairs = zip(motion.q, numbers(waypoint["position"], self.joints), strict=True)
                require(all(abs(q[0] - x) + q[6] <= BOUNDED_EXCESS for q, x in pairs), "a waypoint is missed")
            require(all(is_below(*x) for x in motion.poses(waypoint["tool_pose"])), "the tool misses a waypoint")

    def check_joints(self) -> None:
        """Check the limits of the joints' positions and of their derivatives."""
        for order, name in enumerate(JOINT_CLAIMS):
            for piece, joint, segment in self.cells if name in self.claims else ():
                row = self.derivative(piece, joint, order)
                for sign, side in zip((1, -1), self.limits[name][segment], strict=True):
                    if (limit := side[joint]) is not None:
                        exact = Fraction(*numbers([limit], 1))
                        room = [sign * (row[0] - exact) + EXACT_EXCESS * abs(exact), *(sign * c for c in row[1:])]
                        require(is_one_nonnegative(room), f"the {name} of a joint exceeds its limit")

    def check_velocity_at_position(self) -> None:
        """Check the velocity limits that depend on the position of the joint."""
        curves = self.limits["velocity_at_position"]
        scales = numbers(self.limits["velocity_scale"], len(self.robot_of))
        for piece, joint, segment in self.cells:
            scale = Fraction(scales[segment]) * (1 + EXACT_EXCESS)
            require(scale > 0, "a scale is not positive")
            for curve in curves[joint]:
                sign = -1 if curve["towards"] == "lower" else 1
                p = [sign * c for c in self.derivative(piece, joint, 0)]
                w = [sign * c / scale for c in self.derivative(piece, joint, 1)]
                square, linear, constant, slope = map(Fraction, numbers(curve["coefficients"], 4))
                n = range(len(w))
                squares = [sum(w[i] * w[k - i] for i in n if k - i in n) for k in range(2 * len(w))]
                terms = zip_longest([constant], p, w, squares, fillvalue=Fraction(0))
                room = [x + slope * y - linear * z - square * u for x, y, z, u in terms]
                choices = [room, [EXACT_EXCESS - w[0], *(-c for c in w[1:])]]
                ends = [(side, curve[end]) for end, side in (("low", -1), ("high", 1)) if curve[end] is not None]
                choices += [[side * (p[0] - Fraction(end)), *(side * c for c in p[1:])] for side, end in ends]
                require(is_one_nonnegative(*choices), "a joint is too fast for its position")

    def check_bounded(self) -> None:
        """Check the claims that hold on each of the intervals of the file."""
        claims, ends = set(self.claims) & set(BOUNDED_CLAIMS), self.evidence["bounded"]
        require(ends == sorted({0.0, *ends, self.pieces}), "a piece is not covered")
        for (start, end), along in zip(pairwise(ends), self.evidence["along"] or [None] * (len(ends) - 1), strict=True):
            require(math.ceil(end) - int(start) == 1, "an interval has several pieces")
            motion, segment = self.motion(start, end)
            missing = motion.unproved(claims, self.limits, segment, along)
            require(not missing, f"not proved: {', '.join(sorted(missing))}")

    def check_distances(self) -> None:
        """Check that at all times a plane keeps each pair of shapes apart, or the robot is slow."""
        stretches, scenes = self.stretches(), self.statement["scenes"]
        for name, size in [x for x in zip(DISTANCE_CLAIMS, (3, 4), strict=True) if x[0] in self.claims]:
            counts = ((begin, len(scenes[number][name])) for begin, (number, _) in stretches.items())
            reached = {(begin, pair): float(begin) for begin, count in counts for pair in range(count)}
            for start, end, planes in self.evidence[name]:
                motion, _ = self.motion(start, end)
                begin = max(x for x in stretches if x <= start)
                scene = scenes[stretches[begin][0]]
                for number, normal in planes:
                    key = begin, index(number, len(scene[name]))
                    require(reached[key] == start < end <= stretches[begin][1], "there is a gap or an overlap")
                    reached[key] = end
                    require(motion.is_safe(scene, scene[name][key[1]][:size], normal), f"not proved: {name}")
            require({stretches[k][1] == end for (k, _), end in reached.items()} == {True}, f"{name} lacks evidence")

    def stretches(self) -> dict[int, tuple[int, int]]:
        """Return scene and piece after the last, by the first, of consecutive pieces with the same scene and robot."""
        of_pieces = [(self.scene_of[segment], self.robot_of[segment]) for segment in self.segments]
        cuts = [k for k in range(1, self.pieces) if of_pieces[k] != of_pieces[k - 1]]
        return {a: (of_pieces[a][0], b) for a, b in pairwise([0, *cuts, self.pieces])}


def check_file(file: bytes, expected: Any = None) -> Proof:
    """Check the content of a file and its expected digests; raise ProofRejected unless all hold."""
    try:
        require(len(file) <= MOST_BYTES_OF_PROOF, "the file is too large")
        proof = Proof(json.loads(file.decode(), object_pairs_hook=_object))
        for name, value in dict(expected or {}).items():
            require(value in (None, proof.digests[name]), f"the {name} has another digest than expected")
        groups = {JOINT_CLAIMS: "joints", BOUNDED_CLAIMS: "bounded", DISTANCE_CLAIMS: "distances"}
        for own in sorted({next((x for of, x in groups.items() if name in of), name) for name in proof.claims})[::-1]:
            getattr(proof, f"check_{own}")()
    except (ArithmeticError, AttributeError, IndexError, KeyError, RecursionError, TypeError, ValueError) as error:
        raise ProofRejected(f"the file is malformed ({type(error).__name__}: {error})") from None
    return proof


def main(arguments: list[str]) -> None:
    """Check the file that the arguments name, with expected digests after it; end with 1 if it is rejected."""
    try:
        with Path(arguments[0]).open("rb") as file:
            proof = check_file(file.read(MOST_BYTES_OF_PROOF + 1), zip(DIGESTED, arguments[1:], strict=False))
    except (ProofRejected, OSError) as error:
        sys.exit(f"rejected: {error}")
    lines = [f"accepted: {', '.join(proof.claims)}", *(f"not covered: {x}" for x in proof.statement["not_covered"])]
    print(*lines, *map(" ".join, proof.digests.items()), sep="\n")  # noqa: T201


if __name__ == "__main__":
    main(sys.argv[1:])
