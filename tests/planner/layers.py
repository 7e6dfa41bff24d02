"""The layers of the library."""

from __future__ import annotations

LAYERS = (
    "fields",
    "spatial",
    "errors",
    "tolerances",
    "last_used",
    "polynomials",
    "extrema",
    "sampled_peaks",
    "trajectory",
    "guarantees",
    "robots",
    "limits",
    "dynamics",
    "kinematics",
    "problem",
    "problem_check",
    "tool_motions",
    "waypoints",
    "paths",
    "certificate",
    "backends",
    "durations",
    "result",
    "saved_plan",
    "remedies",
    "planning",
    "operations",
    "comparison",
    "tool_lines",
    "tool_speeds",
    "export",
    "",
)
"""Files and folders of `planner/`, from the ground up; the last is the package's own `__init__`."""
