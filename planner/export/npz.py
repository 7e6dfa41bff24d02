"""NPZ: arrays for numpy, exact to the last bit."""

from __future__ import annotations

from io import BytesIO

import numpy as np

from planner.export.base import ExportOptions, Format
from planner.plans.result import Plan
from planner.problems.actions import SetOutput


def render(plan: Plan, options: ExportOptions) -> bytes:
    """Write a plan as arrays: the samples as `Samples` names them, the joints' names, and the polynomials if included.

    `joint_names` is text (joints,). `arrivals` and `departures` are times (waypoints,), s. `breakpoints` is (pieces +
    1,), s. `coefficients` is (pieces, joints, order), ascending powers of the time since the start of the piece.
    The outputs are `output_time` (outputs,), s, `output_name` and `output_value`, in order of time.
    """
    trajectory, samples = plan.trajectory, vars(plan.samples(options.sample_period, options.include))
    for name in ("velocity", "acceleration"):
        rates = samples.pop(f"tcp_{name}")
        if rates is not None:
            samples[f"tcp_linear_{name}"], samples[f"tcp_angular_{name}"] = rates
    arrays = {name: values for name, values in samples.items() if values is not None}
    if "polynomials" in options.include:
        arrays |= {"breakpoints": trajectory.breakpoints, "coefficients": trajectory.coefficients}
    outputs = [(timed.time, timed.action) for timed in plan.actions if isinstance(timed.action, SetOutput)]
    if outputs:
        arrays |= {
            "output_time": np.array([time for time, _ in outputs]),
            "output_name": np.array([action.name for _, action in outputs]),
            "output_value": np.array([float(action.value) for _, action in outputs]),
        }
    file = BytesIO()
    np.savez(
        file,
        joint_names=np.array(plan.path.robot.joint_names),
        arrivals=trajectory.arrivals,
        departures=trajectory.departures,
        **arrays,
    )
    return file.getvalue()


FORMAT = Format("npz", "application/x-npz", ".npz", render)
"""The form of numpy's archives of arrays."""
