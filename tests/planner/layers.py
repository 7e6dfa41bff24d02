"""The layers of the library."""

from __future__ import annotations

LAYERS = (
    "fields",
    "spatial",
    "choices",
    "errors",
    "tolerances",
    "last_used",
    "quantities",
    "kernels",
    "trajectories",
    "guarantees",
    "shapes",
    "robots",
    "dynamics",
    "kinematics",
    "constraints",
    "limits",
    "samples",
    "scene",
    "roadmap",
    "speed_zones",
    "problems",
    "path_files",
    "tool_motions",
    "waypoints",
    "paths",
    "certificate",
    "time_scaling",
    "backends",
    "timing",
    "free_motion",
    "plots",
    "plans",
    "simulation",
    "proofs",
    "planning",
    "tasks",
    "cells",
    "operations",
    "comparison",
    "export",
    "",
)
"""Files and folders of `planner/`, from the lowest layer up; the last is the package's own `__init__`."""

BACK_ENDS = (
    "base",
    "shared",
    ("splines", "trapezoidal", "jerk_limited"),
    ("ruckig", "toppra", "min_effort"),
    "auto",
    "",
)
"""The same inside `planner/backends/`; back ends in one bracket do not know each other."""
