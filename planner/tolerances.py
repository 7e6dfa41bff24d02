"""The tolerances that mean the same in several places: what is taken for rounding, and what for equal.

Each is relative to the scale of what it judges, or names its unit. What a back end lets pass is smaller than what the
certificate lets pass, so that no plan fails by rounding. A number that only tunes one algorithm, or that one search is
content with, stands beside that algorithm.
"""

LIMIT_TOLERANCE = 1e-9
"""Relative excess over a limit that is rounding and no violation: the certificate's word, and so that of all who ask
whether a limit is kept, reached or exceeded."""

DURATION_TOLERANCE = 3e-10
"""Relative shortfall of a duration, and excess of a factor on time over 1, that back ends take for rounding. A motion
whose time is short by this exceeds its jerk limits by thrice as much, which has to be less than `LIMIT_TOLERANCE`."""

POSITION_TOLERANCE = 1e-9
"""Distance between two positions of a joint, rad or m, up to which they are one: a nanometre at the end of an arm of
1 m, and a thousand times the rounding of positions of a few turns."""

SAME_CONFIGURATION = 1e-7
"""Distance of a joint, rad or m, up to which a motion of the tool ends at a given joint position: following a path
leaves some 1e-11 in each of its steps, and another configuration is far away."""

SAME_SOLUTION = 1e-4
"""Distance of a joint, rad (but for whole turns) or m, up to which two solutions of the inverse kinematics are one:
near a singularity the same solution is found with so much of a difference."""

CONTINUITY_TOLERANCE = 1e-7
"""Jump of a derivative, relative to its largest magnitude, that is rounding: where a piece is a thousandth as long as
its neighbour, third and fourth derivatives lose 1e-8. Beside a singularity, where a joint goes a thousand rad for 1 m
of the tool, the rounding of the place on the path loses more of the acceleration: 1.1e-8 in tests/planner/paths."""

NEGLIGIBLE_SHARE = 1e-9
"""Share of an interval, of length or of time, below which a part of it is nothing: the coefficients of a piece so short
would be all rounding, and so much outside of it is rounding of a sum (such as the multiples of a period)."""

ROUNDING = 1e-12
"""Relative difference of two numbers that rounding alone makes: some thousand units in the last place, as after a few
hundred operations."""
