"""Pictures of simulated runs: following errors, and torques beside the planned ones."""

from __future__ import annotations

from collections.abc import Mapping

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from planner.plots.picture import GRAPH_HEIGHT, HEAD_HEIGHT, Picture
from planner.plots.quantities import Planned, stops_of
from planner.plots.style import STYLE, colour_of
from planner.spatial import FloatArray

ERROR_UNITS = (("0.001°", 1e3 * np.degrees(1.0)), ("µm", 1e6))
"""Units of following errors at joints that turn and at joints that slide, and their number in a rad or m."""

RUN_WIDTH = 11.0
"""Width of the picture, inches."""


CONTACT_COLOUR = "#C0392B"
"""Colour of the lines where contacts begin."""


def draw_simulated(
    plan: Planned,
    facts: str,
    time: FloatArray,
    errors: FloatArray,
    torques: FloatArray,
    planned: FloatArray,
    contacts: Mapping[str, float],
) -> Picture:
    """Draw the following errors, torques and contacts of a simulated run; planned torques are dashed.

    Args:
        plan: The plan.
        facts: A line below the title.
        time: (N,), s.
        errors: (N, joints), the simulated less the planned positions, rad or m.
        torques: (N, joints), N m or N.
        planned: (N, joints), the torques of the planned motion, N m or N.
        contacts: The begin of each contact by its text in the legend, s.
    """
    robot = plan.path.robot
    kinds = [(turns, rows) for turns in (True, False) if len(rows := np.flatnonzero(robot.is_angle == turns))]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(RUN_WIDTH, HEAD_HEIGHT + 2 * GRAPH_HEIGHT), layout="constrained")
        axes = figure.subplots(2, len(kinds), squeeze=False, sharex=True)
        for (above, below), (turns, rows) in zip(axes.T, kinds, strict=True):
            unit, scale = ERROR_UNITS[not turns]
            for joint in rows.tolist():
                colour, name = colour_of(joint), robot.joint_names[joint]
                above.plot(time, errors[:, joint] * scale, color=colour, linewidth=1.4, label=name)
                below.plot(time, torques[:, joint], color=colour, linewidth=1.4)
                below.plot(time, planned[:, joint], "--", color=colour, linewidth=0.9)
            above.set_ylabel(f"following error ({unit})")
            below.set_ylabel("torque (N m)" if turns else "force (N)")
            below.set_xlabel("time (s)")
            for axis in (above, below):
                axis.set_xlim(0.0, time[-1])
                for stop in stops_of(plan):
                    axis.axvline(stop.arrival, color="#BBBBBB", linewidth=0.8, zorder=0)
                for text, begin in contacts.items():
                    label = text if axis is axes[0, 0] else None
                    axis.axvline(begin, color=CONTACT_COLOUR, linewidth=1.2, linestyle=":", label=label)
        figure.legend(loc="outside right upper", fontsize=8, frameon=False)
        figure.suptitle(f"{robot.id}, {plan.backend.kind}, simulated\n", x=0.01, ha="left", fontweight="bold")
        figure.text(0.01, 1.0 - 0.35 / figure.get_figheight(), facts, va="top", fontsize=8, color="#555555")
    return Picture(figure)
