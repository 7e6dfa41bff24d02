"""Plans compared to the last bit."""

from __future__ import annotations

from typing import Any

import planner


def every_bit(plan: planner.Plan) -> tuple[Any, ...]:
    """Return values that only equal plans share: the trajectory's bytes, the certificate, warnings and gains."""
    arrays = (
        getattr(plan.trajectory, name) for name in ("lengths", "coefficients", "segments", "arrivals", "departures")
    )
    gains = [detour.gain for detour in plan.detours]
    return *(array.tobytes() for array in arrays), plan.certificate, plan.warnings, gains
