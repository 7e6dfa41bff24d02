"""Several machines that move in one world on one clock."""

from planner.cells.clearance import ClearanceBetween, clearance_between
from planner.cells.meetings import CellMeeting
from planner.cells.movers import Mover
from planner.cells.plan import CellPlan, plan_cell
from planner.cells.robots import CellRobot

__all__ = ["CellMeeting", "CellPlan", "CellRobot", "ClearanceBetween", "Mover", "clearance_between", "plan_cell"]
