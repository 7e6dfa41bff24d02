"""Free motions: scenes of our own, planned by this library and by others."""
