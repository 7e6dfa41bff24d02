"""Robots in files of other programs."""
