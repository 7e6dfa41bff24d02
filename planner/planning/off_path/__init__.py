"""Shorter durations: waypoints move in their open coordinates, and blends within their radii."""
