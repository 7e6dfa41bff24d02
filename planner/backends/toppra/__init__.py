"""The time-optimal back end on the exact path."""
