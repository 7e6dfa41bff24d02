"""Programs for the pendant: one instruction for each waypoint, which the controller plans for itself."""

from planner.export.pendant import krl, rapid, urscript

__all__ = ["krl", "rapid", "urscript"]
