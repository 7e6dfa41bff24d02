"""How pictures look: colours that colour-blind eyes tell apart, and the rest of the style."""

from __future__ import annotations

from typing import Any

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#5D3A9B")
"""The colours of the joints, in turn (Okabe and Ito)."""

AXIS_COLOURS = ("#C22F2F", "#2E8B3D", "#2F5FC2")
"""The colours of x, y and z, and of roll, pitch and yaw, as viewers of robots have them."""

STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#888888",
    "axes.grid": True,
    "grid.color": "#E6E6E6",
    "grid.linewidth": 0.6,
    "xtick.color": "#444444",
    "ytick.color": "#444444",
    "text.parse_math": False,  # names are as they were given, "$" included
    "svg.hashsalt": "planner",
}
"""Settings of matplotlib, so that the same plan gives the same bytes, too."""


def colour_of(joint: int) -> str:
    """Return the colour of a joint by its index."""
    return COLOURS[joint % len(COLOURS)]
