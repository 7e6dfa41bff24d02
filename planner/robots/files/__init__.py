"""Robots in files of other programs: xacro, MJCF, joint limits of MoveIt, calibrations of Universal Robots."""
