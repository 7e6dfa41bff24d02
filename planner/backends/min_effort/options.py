"""The options of the back end of least effort."""

from __future__ import annotations

from dataclasses import dataclass, field

from planner.backends.min_effort.cost import Objective

LEAST_DEVIATION = 0.001
"""The least deviation that can be requested, m, rad."""

KNOTS_PER_SECOND = 25.0
"""Intervals of the spline from stop to stop for each second of its duration.

Against 50 intervals for every duration, motions of a UR5e have up to 0.4 % more effort. With 32 for every duration, a
motion of 9 s had 2 % more.
"""

FEWEST_SPLINE_KNOTS = 20
"""Least number of these intervals."""

MOST_SPLINE_KNOTS = 50
"""Largest number of these intervals."""


@dataclass(frozen=True)
class MinEffortOptions:
    """The options of the back end: the cost, the intervals of the spline, and the time that a motion may take.

    Attributes:
        objective: The integral that is minimised, s. `effort`: the sum over joints of (torque / limit)^2;
            `mechanical_work`: the sum of |torque x velocity|, by the largest power of any joint; `jerk`: the sum of
            (jerk / limit)^2.
        knots: Intervals of the spline from stop to stop; at least 8 on each segment. None: as many as the duration
            takes (`knots_for`).
        slowdown: How many times the duration of the shortest quintic a motion without a requested duration takes.
        time_weight: Cost of a second; None: durations are not traded against the cost.
        iterations: The largest number of iterations of the search from stop to stop. It then returns the best motion
            found, with the warning `suboptimal`. 0: the first motion; None: as many as take about 7 s. They are
            counted, not timed: equal problems have equal plans.
        max_deviation: The largest distance of the tool from the straight joint motion between two stops, m. If
            waypoints are passed without stopping, it is the distance from the quintic through them. None: any.
        max_joint_deviation: The largest distance of any joint from the same motion, rad (m if it slides); None: any.
    """

    objective: Objective = field(
        default="effort",
        metadata={
            "description": "What is minimised: the integral of the squared torques by their limits, of the joints' "
            "mechanical power, or of the squared jerk."
        },
    )
    knots: int | None = field(
        default=None,
        metadata={
            "description": "The number of intervals of the spline between two stops; at least 8 on each segment. "
            "Omitted: one for each 0.04 s, from 20 to 50.",
            "ge": 8,
            "le": 200,
        },
    )
    slowdown: float = field(
        default=1.0,
        metadata={
            "description": "Duration of a motion without a requested one, as a multiple of the shortest quintic's.",
            "ge": 1.0,
            "le": 100.0,
        },
    )
    time_weight: float | None = field(
        default=None,
        metadata={
            "description": "Cost of a second, added to the objective: the durations that the request leaves open "
            "minimise the sum. Omitted: such a duration is the quintic's.",
            "gt": 0.0,
        },
    )
    iterations: int | None = field(
        default=None,
        metadata={
            "description": "The most iterations from stop to stop. The best motion found by then is the answer, "
            "never worse than the quintic, with the warning `suboptimal`; 0: the motion that the search begins with. "
            "Omitted: the number of iterations that take about 7 s.",
            "ge": 0,
            "le": 10_000,
        },
    )
    max_deviation: float | None = field(
        default=0.1,
        metadata={
            "description": "The largest deviation of the tool, m, from the straight joint motion between two stops. "
            "Where waypoints are passed without stopping, it is the deviation from the quintic through them. Null: no "
            "bound. The certificate's check `tool_deviation` has the deviation from straight joint motions.",
            "ge": LEAST_DEVIATION,
        },
    )
    max_joint_deviation: float | None = field(
        default=None,
        metadata={
            "description": "The largest deviation of each joint, rad (m of a prismatic joint), from the straight joint "
            "motion between two stops. Where waypoints are passed without stopping, it is the deviation from the "
            "quintic through them. Every joint position is this close to one of that motion, joint by joint. Omitted: "
            "`max_deviation` alone bounds the motion. The certificate's check `joint_deviation` has the deviations.",
            "ge": LEAST_DEVIATION,
        },
    )

    def knots_for(self, duration: float) -> int:
        """Return the number of intervals of the spline for a duration, s, from stop to stop."""
        if self.knots is not None:
            return self.knots
        return int(min(max(duration * KNOTS_PER_SECOND, FEWEST_SPLINE_KNOTS), MOST_SPLINE_KNOTS))
