"""The stand-alone checker of proof files: `python checker.py FILE`. It needs nothing but Python.

`docs/proof.md` has the format and the mathematics. The checker trusts no number of a file and no other code.
Polynomials of time are decided in rational numbers. Taylor models with all rounding bound everything else.
"""

from __future__ import annotations

import hashlib
import json
import math
import struct
import sys
from bisect import bisect_right
from fractions import Fraction
from functools import cache
from itertools import accumulate, chain, pairwise
from operator import mul
from pathlib import Path
from typing import Any

Model = tuple[float, ...]  # f on [-1, 1]: six coefficients of a polynomial p, and r with |f(x) - p(x)| <= r
Vector = list[Model]  # three coordinates
Values = dict[str, Any]  # a JSON object
FORMAT = "planner-proof/1"
"""Name and version of the format."""
DIGESTED = ("statement", "trajectory", "evidence")
"""Parts of a file that have a digest."""
JOINT_CLAIMS = ("position", "velocity", "acceleration", "jerk")
"""Claims about the joints, by the order of the derivative."""
TOOL_CLAIMS = ("tcp_linear_velocity", "tcp_angular_velocity", "tcp_linear_acceleration", "tcp_angular_acceleration")
"""Claims about the motion of the tool."""
BOUNDED_CLAIMS = ("torque", "power", "total_power", *TOOL_CLAIMS)
"""Claims that Taylor models prove on the intervals under `bounded`."""
CLAIMS = ("continuity", "waypoints", *JOINT_CLAIMS, "velocity_at_position", *BOUNDED_CLAIMS, "clearance")
"""All claims of the format."""
EXACT_EXCESS = Fraction(1, 10**9)
"""Relative excess over limits of joint positions and their derivatives that counts as rounding."""
BOUNDED_EXCESS = 1e-6
"""Relative excess over limits of torque, power and the tool's motion that counts as rounding."""
JUMP = Fraction(1, 10**7)
"""Jump of a derivative, relative to its largest value, that counts as rounding."""
MISS = Fraction(1, 10**6)
"""Largest distance of a joint from its waypoint, rad or m."""
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
        text = value.encode()
        return b"s%d:" % len(text) + text
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


def _transposed(matrix: list[list[Any]]) -> list[list[Any]]:
    return [list(column) for column in zip(*matrix, strict=True)]


def polynomial(coefficients: list[Any], length: Fraction, order: int) -> list[Fraction]:
    """Return a derivative by time of a piece's polynomial, as a polynomial of u."""
    powers = list(accumulate([length] * len(coefficients), mul, initial=Fraction(1)))
    exact = [Fraction(c) * math.perm(k, order) for k, c in enumerate(coefficients)][order:]
    return [c * power for c, power in zip(exact, powers, strict=False)] or [Fraction(0)]


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
        halves = [_halved(row) for row in rows]
        waiting += [([half[k] for half in halves], depth + 1) for k in (0, 1)]
    return True


def _halved(row: list[int]) -> tuple[list[int], list[int]]:
    levels, n = [row], len(row) - 1
    while len(levels[-1]) > 1:
        levels.append([a + b for a, b in pairwise(levels[-1])])
    return [x[0] << (n - k) for k, x in enumerate(levels)], [x[-1] << (n - k) for k, x in enumerate(levels)][::-1]


def model(coefficients: list[Fraction]) -> Model:
    """Return the Taylor model of an exact polynomial on [-1, 1]."""
    kept = [float(c) for c in coefficients[:6]] + [0.0] * (6 - len(coefficients))
    rest = UNIT * sum(map(abs, kept)) + sum(abs(float(c)) for c in coefficients[6:])
    return (*kept, (rest + 1e-300) * UP)


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
TO_BERNSTEIN = _transposed([[c / common for c in row] for row, common in map(bernstein, POWERS)])
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
    above, below = x.as_integer_ratio()
    fixed = (above << 256) // below
    sums, term, k = [0, 0], 1 << 256, 0
    while term not in (0, -1):
        sums[k % 2] += term if k % 4 < 2 else -term
        k += 1
        term = (term * fixed >> 256) // k
    return sums[1] / (1 << 256), sums[0] / (1 << 256)


def turn_of(q: Model) -> tuple[Model, Model]:
    """Return the Taylor models of sine and cosine of a joint position."""
    sine, cosine = sine_and_cosine(q[0])
    s0, c0 = ((value, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0 * UNIT) for value in (sine, cosine))
    d: Model = (0.0, *q[1:])
    size = sum(map(abs, d)) * UP
    d2 = multiply(d, d)
    d3, d4 = multiply(d2, d), multiply(d2, d2)
    tails = [(0.0,) * 6 + (size**k / math.factorial(k) * UP,) for k in (7, 6)]
    tails.append((0.0,) * 6 + (UNIT * (size**3 + size**5) * UP,))  # the rounding of 1/6, 1/120 and 1/24
    s = combine([1.0, -1.0 / 6.0, 1.0 / 120.0, 1.0, 1.0], [d, d3, multiply(d4, d), tails[0], tails[2]])
    c = combine([1.0, -0.5, 1.0 / 24.0, 1.0, 1.0], [ONE, d2, d4, tails[1], tails[2]])
    return _add(multiply(s0, c), multiply(c0, s)), _add(multiply(c0, c), combine([-1.0], [multiply(s0, s)]))


def _cross(a: Vector, b: Vector) -> Vector:
    terms = ((multiply(a[i], b[j]), multiply(a[j], b[i])) for i, j in ((1, 2), (2, 0), (0, 1)))
    return [combine([1.0, -1.0], [*pair]) for pair in terms]


def _crossed(a: Vector, b: list[float]) -> Vector:
    return [combine([b[j], -b[i]], [a[i], a[j]]) for i, j in ((1, 2), (2, 0), (0, 1))]


class Motion:
    """The Taylor models of the joints' positions `q`, velocities `v` and accelerations `a` on an interval."""

    def __init__(self, robot: Values, q: Vector, v: Vector, a: Vector):
        self.robot, self.links, self.q, self.v, self.a = robot, robot["links"], q, v, a
        turning = [link["motion"] == "revolute" for link in self.links]
        self.turns = [turn_of(x) if turns else (ZERO, ONE) for x, turns in zip(q, turning, strict=True)]
        self.known: dict[int, list[tuple[list[Vector], Vector]]] = {}

    def shift(self, k: int) -> Vector:
        """Return the origin of a joint's frame in the frame before."""
        link, slides = self.links[k], float(self.links[k]["motion"] != "revolute")
        rows = zip(link["origin"], link["rotation"], strict=True)
        return [combine([1.0, slides * row[2]], [(x, *ZERO[1:]), self.q[k]]) for x, row in rows]

    def turned(self, k: int, vector: Vector, sign: float) -> Vector:
        """Turn a vector by a joint's angle (sign 1) or back (sign -1)."""
        (sine, cosine), (x, y, z) = self.turns[k], vector
        pairs = ((x, y, -sign), (y, x, sign))
        return [*(combine([1.0, s], [multiply(cosine, p), multiply(sine, q)]) for p, q, s in pairs), z]

    def outward(self, k: int, vector: Any) -> Vector:
        """Return a vector of the frame before in the frame of a joint."""
        vector = list(vector)
        return self.turned(k, [combine(column, vector) for column in _transposed(self.links[k]["rotation"])], -1.0)

    def inward(self, k: int, vector: Vector) -> Vector:
        """Return a vector of the frame of a joint in the frame before."""
        vector = self.turned(k, vector, 1.0)
        return [combine(row, vector) for row in self.links[k]["rotation"]]

    def frames(self, start: int) -> list[tuple[list[Vector], Vector]]:
        """Compute the frames from `start` on, in the frame `start`."""
        found = [([[ONE, ZERO, ZERO], [ZERO, ONE, ZERO], [ZERO, ZERO, ONE]], [ZERO] * 3)]
        for k in range(start, len(self.links) if start not in self.known else 0):
            rows, origin = found[-1]
            moved = [_add(o, *map(multiply, row, self.shift(k))) for row, o in zip(rows, origin, strict=True)]
            found.append(([self.outward(k, row) for row in rows], moved))
        return self.known.setdefault(start, found)

    def rates(self, gravity: list[float]) -> list[tuple[Vector, Vector, Vector, Vector]]:
        """Compute velocities, accelerations, and both of the angles, of each frame in its own axes."""
        rest = [ZERO] * 3
        found = [(rest, [(-g, *ZERO[1:]) for g in gravity], rest, rest)]
        for k, link in enumerate(self.links):
            (v, a, w, dw), shift, rate, gain = found[-1], self.shift(k), self.v[k], self.a[k]
            a = self.outward(k, map(_add, a, _cross(dw, shift), _cross(w, _cross(w, shift))))
            v = self.outward(k, map(_add, v, _cross(w, shift)))
            w, dw = self.outward(k, w), self.outward(k, dw)
            across = [multiply(w[1], rate), combine([-1.0], [multiply(w[0], rate)])]
            if link["motion"] == "revolute":
                w, dw = [w[0], w[1], _add(w[2], rate)], list(map(_add, dw, [*across, gain]))
            else:
                v, gains = [v[0], v[1], _add(v[2], rate)], [*(combine([2.0], [x]) for x in across), gain]
                a = list(map(_add, a, gains))
            found.append((v, a, w, dw))
        return found

    def torques(self) -> list[Model]:
        """Compute the torque or force of each joint by the recursive Newton-Euler algorithm."""
        rates, found = self.rates(self.robot["gravity"]), []
        force, moment = [ZERO] * 3, [ZERO] * 3
        for k in range(len(self.links) - 1, -1, -1):
            link, (_, a, w, dw) = self.links[k], rates[k + 1]
            center, inertia, mass = link["center_of_mass"], link["inertia"], [link["mass"]]
            push = [combine(mass, [x]) for x in map(_add, a, _crossed(dw, center), _cross(w, _crossed(w, center)))]
            spin = _cross(w, [combine(row, w) for row in inertia])
            turn = map(_add, [combine(row, dw) for row in inertia], spin, _crossed(push, [-x for x in center]))
            moment = list(map(_add, moment, turn))
            force = list(map(_add, force, push))
            found.append(moment[2] if link["motion"] == "revolute" else force[2])
            force, moment = self.inward(k, force), self.inward(k, moment)
            moment = list(map(_add, moment, _cross(self.shift(k), force)))
        return found[::-1]

    def tool_squares(self) -> dict[str, Model]:
        """Compute the squares of the tool's velocities and accelerations."""
        v, a, w, dw = self.rates([0.0] * 3)[self.robot["tool"]["joint"]]
        point = self.robot["tool"]["translation"]
        gains = map(_add, a, _crossed(dw, point), _cross(w, _crossed(w, point)))
        vectors = zip(TOOL_CLAIMS, map(list, (map(_add, v, _crossed(w, point)), w, gains, dw)), strict=True)
        return {name: _add(*map(multiply, x, x)) for name, x in vectors}

    def unproved(self, claims: set[str], limits: Values, segment: int) -> set[str]:
        """Return the claims of torque, power and the tool's motion that are not proved."""
        own = {name: limits[name][segment] for name in claims}
        torques = [] if claims.isdisjoint(BOUNDED_CLAIMS[:3]) else self.torques()
        powers = [multiply(torque, v) for torque, v in zip(torques, self.v, strict=False)]
        rows = zip(torques, *own["torque"], strict=True) if "torque" in own else ()
        checks: list[Any] = [("torque", x, least, most) for x, least, most in rows]
        for name in claims & {"power", "total_power"}:
            values, most = (powers, own[name]) if name == "power" else ([_add(*powers)], [own[name]])
            checks += [(name, x, y if y is None else -y, y) for x, y in zip(values, most, strict=True)]
        squares = {} if claims.isdisjoint(TOOL_CLAIMS) else self.tool_squares()
        checks += [(x, squares[x], None, own[x] and own[x] * abs(own[x])) for x in claims & squares.keys()]
        sides = [(name, [-1.0], x, low and -low) for name, x, low, _ in checks]
        sides += [(name, [1.0], x, high) for name, x, _, high in checks]
        known = [(name, combine(sign, [x]), y) for name, sign, x, y in sides if y is not None]
        return {name for name, x, y in known if not is_below(x, y + BOUNDED_EXCESS * abs(y))}

    def is_at_pose(self, target: Values) -> bool:
        """Tell whether the tool is at a pose up to its tolerances."""
        tool, (distance, angle) = self.robot["tool"], numbers(target["tolerance"], 2)
        require(min(distance, angle) >= 0.0, "a tolerance is negative")
        rows, origin = self.frames(0)[tool["joint"]]
        weights = [[*tool["translation"], 1.0, -x] for x in target["position"]]
        apart = [combine(w, [*row, o, ONE]) for w, row, o in zip(weights, rows, origin, strict=True)]
        turned = []
        for row, aim in zip(rows, target["rotation"] or [], strict=target["rotation"] is not None):
            turned += [combine([*z, -x], [*row, ONE]) for z, x in zip(_transposed(tool["rotation"]), aim, strict=True)]
        angle = min(angle, 1.0) + 1e-9  # |A - B|^2 = 8 sin^2(angle / 2) >= 2 angle^2 - angle^4 / 6
        checks = [(apart, (distance + 1e-9) ** 2), (turned, 2.0 * angle**2 - angle**4 / 6.0)]
        return all(is_below(_add(*map(multiply, x, x)), limit) for x, limit in checks)

    def keeps_apart(self, scene: Values, pair: int, normal: list[float] | None) -> bool:
        """Tell whether a plane that moves with the first shape of a pair keeps both apart by their margin."""
        one, other, margin = scene["pairs"][pair]
        first, second = (scene["shapes"][index(x, len(scene["shapes"]))] for x in (one, other))
        start, end = first["joint"], second["joint"]
        require(start <= end and "offset" not in second, "a pair is in the wrong order")
        n = numbers(first["normal"] if "offset" in first else normal, 3)
        size, margin = math.sqrt(sum(x * x for x in n)), margin - CONTACT
        require(0.5 <= size <= 2.0, "a normal has no direction")  # noqa: PLR2004
        rows, origin = self.frames(start)[end - start]
        turned, offset = [combine(n, column) for column in _transposed(rows)], combine(n, origin)
        far = first["offset"] if "offset" in first else reach(first, n, size)
        disc = 0.0
        if second["disc"] > 0.0:
            along = combine(second["axis"], turned)
            least = max(-upper(combine([-1.0], [along])), -upper(along), 0.0)
            disc = second["disc"] * math.sqrt(max(size**2 * UP - least**2, 0.0))
        needed = far + second["ball"] * size + disc + margin * size
        needed += (UP - 1.0) * (abs(far) + (second["ball"] + abs(margin)) * size + disc)
        points = ([-1.0, *(-x for x in point)] for point in second["points"])
        return all(is_below(combine(weights, [offset, *turned]), -needed) for weights in points)


def reach(shape: Values, n: list[float], size: float) -> float:
    """Return an upper bound of n . x over a shape."""
    pad = 1e-14 * size
    products = [(sum(map(mul, n, x)), sum(map(abs, x))) for x in shape["points"]]
    least = max(abs(sum(map(mul, n, shape["axis"]))) - 4.0 * pad, 0.0)
    disc = shape["disc"] * math.sqrt(max(size**2 * UP - least**2, 0.0))
    return float(max(value + pad * far for value, far in products) + (shape["ball"] * size + disc) * UP)


class Proof:
    """A proof file, well-formed so far as it is read."""

    def __init__(self, content: Values):
        require(content["format"] == FORMAT, f"the format is not {FORMAT}")
        self.statement, self.trajectory, self.evidence = parts = [content[name] for name in DIGESTED]
        self.digests = dict(zip(DIGESTED, map(digest, parts), strict=True))
        require(content["digests"] == self.digests, "a digest does not match")
        self.claims: list[str] = self.statement["claims"]
        require(set(self.claims) <= set(CLAIMS) and len(set(self.claims)) == len(self.claims), "a claim is unknown")
        self.limits, rows = self.statement["limits"], self.trajectory["coefficients"]
        self.pieces, self.joints, order = len(rows), len(rows[0]), len(rows[0][0])
        self.lengths = [Fraction(x) for x in numbers(self.trajectory["lengths"], self.pieces)]
        require(order <= 16 and min(self.lengths) > 0 and {len(row) for row in rows} == {self.joints}, "a bad piece")
        self.rows = [[numbers(row, order) for row in piece] for piece in rows]
        self.begins = list(accumulate(self.lengths, initial=Fraction(0)))
        segments = self.statement["segments"]
        self.segments = [index(x, segments) for x in self.trajectory["segments"]]
        require(self.segments == sorted(self.segments) and len(self.segments) == self.pieces, "segments are malformed")
        self.robots: list[Values] = self.statement["robots"]
        require(all(len(robot["links"]) == self.joints for robot in self.robots), "a robot has other joints")
        for robot in self.robots:
            index(robot["tool"]["joint"], self.joints + 1)
        scenes = self.statement["scenes"]
        for shape in chain(*(scene["shapes"] for scene in scenes)):
            index(shape["joint"], 1 if "offset" in shape else self.joints + 1)
            require("offset" in shape or min(numbers([shape["disc"], shape["ball"]], 2)) >= 0.0, "a radius is negative")
        self.robot_of = [index(x, len(self.robots)) for x in self.statement["robot_of_segment"]]
        self.scene_of = [index(x, len(scenes)) for x in self.statement["scene_of_segment"]]
        require(len(self.robot_of) == segments and len(self.scene_of) in (0, segments), "a segment has no robot")
        self.hulls = cache(self.hull)
        self.cells = [(i, j, self.segments[i]) for i in range(self.pieces) for j in range(self.joints)]

    def derivative(self, piece: int, joint: int, order: int) -> list[Fraction]:
        """Return a derivative of a joint's position on a piece, as a polynomial of u."""
        return polynomial(self.rows[piece][joint], self.lengths[piece], order)

    def motion(self, start: float, end: float) -> tuple[Motion, int]:
        """Return the motion between two times, each the number of a piece and a share of it, and its segment."""
        require(0.0 <= min(numbers([start, end], 2)) <= end <= self.pieces, "an interval is out of range")
        first = min(int(start), self.pieces - 1)
        last = max(math.ceil(end) - 1, first)
        segment, robot = self.segments[first], self.robots[self.robot_of[self.segments[first]]]
        if last == first:
            return Motion(robot, *self.models(first, Fraction(start) - first, Fraction(end) - first)), segment
        cells = {(self.robot_of[k], self.scene_of[k]) for k in self.segments[first : last + 1]}
        require(len(cells) == 1, "an interval has two robots or scenes")
        require(start == first and end == last + 1, "an interval of several pieces ends within one")
        return Motion(robot, [self.chord(j, first, last) for j in range(self.joints)], [], []), segment

    def models(self, piece: int, start: Fraction, end: Fraction) -> tuple[Vector, Vector, Vector]:
        """Return the Taylor models of positions, velocities and accelerations on a part of a piece."""
        middle, half = self.lengths[piece] * (start + end) / 2, self.lengths[piece] * (end - start) / 2
        found: tuple[Vector, Vector, Vector] = ([], [], [])
        for row in self.rows[piece]:
            shifted = [Fraction(c) for c in row]
            for k in range(len(row) if middle else 0):
                for i in range(len(row) - 2, k - 1, -1):
                    shifted[i] += middle * shifted[i + 1]
            for order, into in enumerate(found):
                into.append(model(polynomial(shifted, half, order)))
        return found

    def hull(self, piece: int, joint: int) -> list[float]:
        """Return the Bernstein coefficients of a joint's position on a piece, rounded."""
        row, common = bernstein(self.derivative(piece, joint, 0))
        return [c / common for c in row]

    def chord(self, joint: int, first: int, last: int) -> Model:
        """Return the Taylor model of a joint's position on several pieces: a straight line and its largest error."""
        hulls = [self.hulls(piece, joint) for piece in range(first, last + 1)]
        begin, *_, end = ends = self.begins[first : last + 2]
        times = [float((time - begin) / (end - begin)) for time in ends]
        low, rise = hulls[0][0], hulls[-1][-1] - hulls[0][0]
        n = len(hulls[0])
        spans = [one + (two - one) * (k / max(n - 1, 1)) for one, two in pairwise(times) for k in range(n)]
        error = max(abs(c - low - rise * t) for c, t in zip(chain(*hulls), spans, strict=True))
        error += 1e-14 * max(map(abs, chain(*hulls))) + 1e-300
        return (low + rise / 2.0, rise / 2.0, *ZERO[2:6], error)

    def check_continuity(self) -> None:
        """Check that derivatives up to the claimed order do not jump, from and to the motion at the ends."""
        for order in range(index(self.statement["continuity"], 5) + 1):
            rows = [[self.derivative(i, j, order) for j in range(self.joints)] for i in range(self.pieces)]
            largest = max(Fraction(max(map(abs, b)), common) for piece in rows for b, common in map(bernstein, piece))
            starts = [[row[0] for row in piece] for piece in rows]
            stops = [[sum(row, Fraction(0)) for row in piece] for piece in rows]
            ends = [self.statement["ends"][name][order] for name in ("initial", "final")]
            before, after = ([Fraction(x) for x in numbers(end, self.joints)] for end in ends)
            for one, other in zip([before, *stops], [*starts, after], strict=True):
                jump = max(abs(x - y) for x, y in zip(one, other, strict=True))
                require(jump <= JUMP * largest, f"derivative {order} of the position jumps")

    def check_waypoints(self) -> None:
        """Check that joints and tool are where they are to be at the times of the waypoints."""
        waypoints = self.statement["waypoints"]
        times = [Fraction(x) for x in numbers([waypoint["time"] for waypoint in waypoints], len(waypoints))]
        ends = (Fraction(0), *times, self.begins[-1] * (1 + EXACT_EXCESS))
        require(all(a <= b for a, b in pairwise(ends)), "the times of the waypoints are out of order")
        for time, waypoint in zip(times, waypoints, strict=True):
            piece = bisect_right(self.begins, time, 0, self.pieces) - 1
            share = min((time - self.begins[piece]) / self.lengths[piece], Fraction(1))
            if waypoint["position"] is not None:
                for joint, position in enumerate(numbers(waypoint["position"], self.joints)):
                    met = sum(c * share**k for k, c in enumerate(self.derivative(piece, joint, 0)))
                    require(abs(met - Fraction(position)) <= MISS, "a waypoint is missed")
            if waypoint["pose"] is not None:
                robot = self.robots[index(waypoint["robot"], len(self.robots))]
                motion = Motion(robot, *self.models(piece, share, share))
                require(motion.is_at_pose(waypoint["pose"]), "the tool misses the pose of a waypoint")

    def check_joints(self) -> None:
        """Check the limits of the joints' positions and of their derivatives."""
        for order, name in enumerate(JOINT_CLAIMS):
            for piece, joint, segment in self.cells if name in self.claims else ():
                least, most = (side[joint] for side in self.limits[name][segment])
                row = self.derivative(piece, joint, order)
                sides = [(-1, most), (1, None if least is None else -least)]
                for sign, limit in [(sign, Fraction(limit)) for sign, limit in sides if limit is not None]:
                    room = [limit + EXACT_EXCESS * abs(limit) + sign * row[0], *(sign * c for c in row[1:])]
                    require(is_one_nonnegative(room), f"the {name} of a joint exceeds its limit")

    def check_velocity_at_position(self) -> None:
        """Check the velocity limits that depend on the position of the joint."""
        curves = self.limits["velocity_at_position"]
        scales = numbers(self.limits["velocity_scale"], self.statement["segments"])
        for piece, joint, segment in self.cells:
            scale = Fraction(scales[segment]) * (1 + EXACT_EXCESS)
            require(scale > 0, "a scale is not positive")
            for curve in curves[joint]:
                sign = -1 if curve["towards"] == "lower" else 1
                p = [sign * c for c in self.derivative(piece, joint, 0)]
                w = [sign * c / scale for c in self.derivative(piece, joint, 1)]
                square, linear, constant, slope = map(Fraction, numbers(curve["coefficients"], 4))
                room = [slope * c for c in p] + [Fraction(0)] * len(w)
                for k, c in enumerate(w):
                    room[k] -= linear * c
                    for i, d in enumerate(w):
                        room[k + i] -= square * c * d
                room[0] += constant
                choices = [room, [EXACT_EXCESS - w[0], *(-c for c in w[1:])]]
                ends = [(side, curve[end]) for end, side in (("low", -1), ("high", 1)) if curve[end] is not None]
                choices += [[side * (p[0] - Fraction(end)), *(side * c for c in p[1:])] for side, end in ends]
                require(is_one_nonnegative(*choices), "a joint is too fast for its position")

    def check_bounded(self) -> None:
        """Check the limits of torque, power and the tool's motion on the intervals of the file."""
        intervals = list(pairwise(self.evidence["bounded"]))
        require_cover(intervals, self.pieces)
        for start, end in intervals:
            require(math.ceil(end) - int(start) == 1, "an interval has several pieces")
            motion, segment = self.motion(start, end)
            missing = motion.unproved(set(self.claims) & set(BOUNDED_CLAIMS), self.limits, segment)
            require(not missing, f"not proved: {', '.join(sorted(missing))}")

    def check_clearance(self) -> None:
        """Check that a plane keeps each pair of shapes apart at all times."""
        covered: dict[tuple[int, int], list[tuple[float, float]]] = {}
        for start, end, planes in self.evidence["clearance"]:
            motion, segment = self.motion(start, end)
            scene = self.statement["scenes"][self.scene_of[segment]]
            for pair, normal in planes:
                key = self.scene_of[segment], index(pair, len(scene["pairs"]))
                covered.setdefault(key, []).append((start, end))
                require(motion.keeps_apart(scene, pair, normal), "a clearance is not proved")
        for number, _, (first, last) in self.stretches():
            for pair in range(len(self.statement["scenes"][number]["pairs"])):
                own = sorted(x for x in covered.get((number, pair), []) if first <= x[0] < last)
                require_cover([(start - first, end - first) for start, end in own], last - first)

    def stretches(self) -> list[tuple[int, int, tuple[int, int]]]:
        """Return scene and robot of consecutive pieces, each with the first piece and the one after the last."""
        of_pieces = [(self.scene_of[segment], self.robot_of[segment]) for segment in self.segments]
        cuts = [k for k in range(1, self.pieces) if of_pieces[k] != of_pieces[k - 1]]
        return [(*of_pieces[a], (a, b)) for a, b in pairwise([0, *cuts, self.pieces])]

    def check(self) -> None:
        """Check all claims; raise ProofRejected unless each is proved."""
        methods = dict.fromkeys(BOUNDED_CLAIMS, self.check_bounded) | dict.fromkeys(JOINT_CLAIMS, self.check_joints)
        methods |= {"continuity": self.check_continuity, "waypoints": self.check_waypoints}
        methods |= {"velocity_at_position": self.check_velocity_at_position, "clearance": self.check_clearance}
        for method in dict.fromkeys(methods[claim] for claim in CLAIMS if claim in self.claims):
            method()


def require_cover(intervals: list[tuple[float, float]], pieces: int) -> None:
    """Reject the file unless intervals, in order, cover some pieces without gaps."""
    require(bool(intervals) and intervals[0][0] == 0.0 and intervals[-1][1] == pieces, "a piece is not covered")
    ends = [x for interval in intervals for x in interval]
    require(all(a < b for a, b in intervals) and ends[1:-1:2] == ends[2::2], "there is a gap")


def check_file(file: Any, expected: Any = None) -> Proof:
    """Check a proof file, its text or its content, and its expected digests; raise ProofRejected unless all hold."""
    try:
        proof = Proof(json.loads(file) if isinstance(file, str | bytes) else file)
        for name, value in dict(expected or {}).items():
            require(value in (None, proof.digests[name]), f"the {name} has another digest than expected")
        proof.check()
    except (ArithmeticError, AttributeError, IndexError, KeyError, RecursionError, TypeError, ValueError) as error:
        raise ProofRejected(f"the file is malformed ({type(error).__name__}: {error})") from None
    return proof


def main(arguments: list[str]) -> int:
    """Check the file that the arguments name, with expected digests after it; 0: accepted, 1: rejected."""
    try:
        proof = check_file(Path(arguments[0]).read_text(encoding="utf-8"), zip(DIGESTED, arguments[1:], strict=False))
    except (ProofRejected, OSError, UnicodeDecodeError) as error:
        sys.exit(f"rejected: {error}")
    lines = [f"accepted: {', '.join(proof.claims)}", *(f"not covered: {x}" for x in proof.statement["not_covered"])]
    print(*lines, *(f"{name} {value}" for name, value in proof.digests.items()), sep="\n")  # noqa: T201
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
