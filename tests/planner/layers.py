"""The layers of the library."""

from __future__ import annotations

LAYERS = (
    "fields",
    "spatial",
    "errors",
    "tolerances",
    "last_used",
    "quantities",
    "kernels",
    "trajectories",
    "guarantees",
    "shapes",
    "robots",
    "limits",
    "dynamics",
    "kinematics",
    "samples",
    "scene",
    "speed_zones",
    "problems",
    "tool_motions",
    "waypoints",
    "paths",
    "certificate",
    "backends",
    "timing",
    "free_motion",
    "plots",
    "plans",
    "planning",
    "operations",
    "comparison",
    "export",
    "",
)
"""Files and folders of `planner/`, from the ground up; the last is the package's own `__init__`."""
