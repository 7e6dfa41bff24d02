"""The quantities of the certificate: their titles and units, for everything that shows them."""

from __future__ import annotations

from typing import NamedTuple


class Measure(NamedTuple):
    """A quantity as people are shown it.

    Attributes:
        title: Its name, to begin a line with.
        unit: Its unit; at a joint that slides `unit_of_sliding`, where that differs.
        unit_of_sliding: Its unit at a joint that slides; None: `unit`.
    """

    title: str
    unit: str
    unit_of_sliding: str | None = None

    def unit_at(self, is_angle: bool) -> str:
        """Return the unit at a joint that turns, or at one that slides."""
        return self.unit if is_angle or self.unit_of_sliding is None else self.unit_of_sliding


MEASURES = {
    "position": Measure("Position", "rad", "m"),
    "velocity": Measure("Velocity", "rad/s", "m/s"),
    "velocity_at_position": Measure("Velocity at its position", "rad/s", "m/s"),
    "acceleration": Measure("Acceleration", "rad/s²", "m/s²"),
    "jerk": Measure("Jerk", "rad/s³", "m/s³"),
    "acceleration_at_speed": Measure("Acceleration at its speed", "rad/s²", "m/s²"),
    "jerk_at_speed": Measure("Jerk at its speed", "rad/s³", "m/s³"),
    "torque": Measure("Torque", "N m", "N"),
    "torque_at_speed": Measure("Torque at its speed", "N m", "N"),
    "torque_with_tolerances": Measure("Torque within tolerances", "N m", "N"),
    "rms_torque": Measure("Continuous torque (RMS)", "N m", "N"),
    "power": Measure("Power", "W"),
    "total_power": Measure("Total power", "W"),
    "tcp_linear_velocity": Measure("Tool speed", "m/s"),
    "tcp_angular_velocity": Measure("Tool turning speed", "rad/s"),
    "tcp_linear_acceleration": Measure("Tool acceleration", "m/s²"),
    "tcp_angular_acceleration": Measure("Tool turning acceleration", "rad/s²"),
    "tcp_centripetal_acceleration": Measure("Tool acceleration across", "m/s²"),
    "tcp_linear_jerk": Measure("Tool jerk", "m/s³"),
    "tcp_angular_jerk": Measure("Tool turning jerk", "rad/s³"),
    "path_position_deviation": Measure("Off the path", "m"),
    "path_orientation_deviation": Measure("Off the orientation", "rad"),
    "object_position_deviation": Measure("Off the pose on its object", "m"),
    "object_orientation_deviation": Measure("Off the orientation on its object", "rad"),
    "tool_axis_angle": Measure("Tool axis off its direction", "rad"),
    "tool_orientation_angle": Measure("Tool off its orientation", "rad"),
    "tool_plane_distance": Measure("Tool off its plane", "m"),
    "tool_line_distance": Measure("Tool off its line", "m"),
    "tool_beyond_box": Measure("Tool beyond its box", "m"),
    "tool_beyond_half_space": Measure("Tool beyond its half-space", "m"),
    "blend_deviation": Measure("Corners cut by", "m"),
    "passing_velocity_error": Measure("Passing velocity error", "rad/s", "m/s"),
    "waypoint_position_error": Measure("Tool off a waypoint", "m"),
    "waypoint_orientation_error": Measure("Tool turned off a waypoint", "rad"),
    "duration_error": Measure("Duration error", "s"),
    "tool_deviation": Measure("Tool off the straight motion", "m"),
    "residual_vibration": Measure("Residual vibration", "rad", "m"),
    "joint_deviation": Measure("Joint off the straight motion", "rad", "m"),
}
"""Every quantity that a check of the certificate may have: no `Check` is made of another."""
