"""The forms that a plan can leave in: one file for each language."""

from __future__ import annotations

from planner.export import c_header, csv, fanuc, krl, mcap, npz, rapid, ros2, urscript
from planner.export.base import INCLUDABLE, ExportOptions, Format
from planner.plans.result import Plan

FORMATS: dict[str, Format] = {
    form.name: form
    for form in (
        csv.FORMAT,
        ros2.FORMAT,
        npz.FORMAT,
        mcap.FORMAT,
        urscript.FORMAT,
        urscript.FORMAT_MOVES,
        krl.FORMAT,
        krl.FORMAT_KSS_5,
        krl.FORMAT_KSS_8,
        rapid.FORMAT,
        rapid.FORMAT_MOVES,
        fanuc.FORMAT,
        c_header.FORMAT,
    )
}
"""Every format by its name."""


def render(plan: Plan, format: str, options: ExportOptions = ExportOptions()) -> bytes:
    """Write a plan in one of `FORMATS`.

    Args:
        plan: The plan.
        format: `csv`, `ros2` (a `JointTrajectory` message as JSON), `npz` (numpy's arrays), `mcap` (a recording of
            ROS 2 messages). Robot programs are `urscript` and `urscript_moves` (Universal Robots), `krl`,
            `krl_kss5` and `krl_kss8` (KUKA), `rapid` and `rapid_moves` (ABB), `fanuc_ls` (Fanuc), `c_header`
            (microcontrollers).
        options: The period of the samples, and the included quantities.

    Returns:
        The content of a file.

    Raises:
        ValueError: There is no such format.
        MissingDynamics: Torques are included, and the robot has neither inertias nor a payload.
        UnsupportedFormat: The format cannot carry the motion of this robot.
    """
    if format not in FORMATS:
        raise ValueError(f"there is no format {format!r}; the formats are {', '.join(FORMATS)}")
    return FORMATS[format].render(plan, options)


__all__ = ["FORMATS", "INCLUDABLE", "ExportOptions", "Format", "render"]
