"""Lists of waypoints through every back end, beside their peers."""
