"""Ways around obstacles: scenes of our own, planned by this library and by others."""
