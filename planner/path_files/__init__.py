"""Paths in files of CAD, CAM and tables, read as waypoints."""
