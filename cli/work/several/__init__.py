"""Plans of several tasks in any order, and of several robots in one cell."""
