"""Several machines that move in one world on one clock."""

from planner.cells.clearance import ClearanceBetween, clearance_between
from planner.cells.movers import Mover

__all__ = ["ClearanceBetween", "Mover", "clearance_between"]
