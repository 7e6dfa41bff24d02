"""The planning problem and the checks of its fields."""
