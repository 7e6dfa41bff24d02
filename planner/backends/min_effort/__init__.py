"""The back end of least effort, by nonlinear programming."""
