"""The exact check of a trajectory, of the path of its tool, and of samples of any origin."""
