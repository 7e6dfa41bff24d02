"""Several machines that move in one world on one clock."""

from planner.cells.clearance import ClearanceBetween, clearance_between
from planner.cells.movers import Mover
from planner.cells.plan import CellPlan, CellRobot, plan_cell

__all__ = ["CellPlan", "CellRobot", "ClearanceBetween", "Mover", "clearance_between", "plan_cell"]
