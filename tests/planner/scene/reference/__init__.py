"""Plain numpy instead of the kernels of distances, for all pairs and intervals of a round at once."""
