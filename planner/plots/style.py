"""The look of pictures: colours that colour-blind eyes tell apart, the rest of the style, and well-formed XML."""

from __future__ import annotations

import re
from typing import Any

from planner.spatial import FloatArray

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


FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""A character that no document of XML 1.0 has, escaped or not (https://www.w3.org/TR/xml/#charsets, production 2)."""


def well_formed(document: str) -> str:
    """Return a document with U+FFFD for every character that XML has not, which names and titles may hold."""
    return FORBIDDEN.sub("\N{REPLACEMENT CHARACTER}", document)


def svg_points(points: FloatArray) -> str:
    """Write points (N, 2) as SVG has them."""
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points.tolist())
