"""The polynomial back ends: cubic and quintic, and splines through waypoints."""
