"""The shortest durations of segments whose motions depend on each other's durations."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.kinematics.poses import FloatArray


def shortest_durations(
    evaluate: Callable[[FloatArray], FloatArray], start: FloatArray, asked: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Durations (segments,) of least sum that keep limits, for any motion whose shape scales with time.

    Args:
        evaluate: Durations to the worst ratio (segments,) of each segment to its limits: the largest of
            velocity ratio, sqrt(acceleration ratio) and cbrt(jerk ratio), so that all durations times k
            give all ratios divided by k.
        start: (segments,), s, positive; where to begin.
        asked: (segments,), s; NaN where free.

    Returns:
        Durations and their ratios, both (segments,); a ratio above 1 says that the asked durations are too short.
    """
    raise NotImplementedError
