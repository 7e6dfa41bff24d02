"""Tolerances with one meaning in several modules: thresholds of rounding and of equality.

Each is relative to the scale of its quantity, or names its unit. The back ends' tolerances are smaller than the
certificate's, so that no plan fails by rounding. A number that only tunes one algorithm stands beside that algorithm.
"""

LIMIT_TOLERANCE = 1e-9
"""Relative excess over a limit that counts as rounding, not as a violation.

The certificate uses it, and every check whether a limit is kept, reached or exceeded.
"""

DURATION_TOLERANCE = 3e-10
"""Relative shortfall of a duration, and excess of a factor on time over 1, that back ends take for rounding. A motion
whose time is short by this exceeds its jerk limits by thrice as much, which has to be less than `LIMIT_TOLERANCE`."""

POSITION_TOLERANCE = 1e-9
"""Largest distance between two equal positions of a joint, rad or m.

It is a nanometre at the end of an arm of 1 m, and a thousand times the rounding of positions of a few turns.
"""

SAME_CONFIGURATION = 1e-7
"""Distance of a joint, rad or m, below which a tool motion ends at a given joint position.

Following a path leaves some 1e-11 in each of its steps, and another configuration is far away.
"""

SAME_SOLUTION = 1e-4
"""Distance of a joint, rad (but for whole turns) or m, up to which two solutions of the inverse kinematics are one:
near a singularity the same solution is found with so much of a difference."""

CONTINUITY_TOLERANCE = 1e-7
"""Jump of a derivative, relative to its largest magnitude, that counts as rounding.

If a piece is a thousandth as long as its neighbour, third and fourth derivatives lose 1e-8. Beside a singularity, where
a joint moves a thousand rad for 1 m of the tool, the rounding of the path position costs more. The acceleration loses
1.1e-8 in tests/planner/paths.
"""

NEGLIGIBLE_SHARE = 1e-9
"""Fraction of an interval of length or time below which a part of it is negligible.

The coefficients of so short a piece would be pure rounding. So is such an excess over the interval, from a sum such as
the multiples of a period.
"""

ROUNDING = 1e-12
"""Relative difference of two numbers that rounding alone makes: some thousand units in the last place, as after a few
hundred operations."""

BISECTIONS = 60
"""Steps of bisection after which a number is as exact as a floating-point number of 53 bits."""
