"""Rides on moving objects: when the robot gets on, and the latest start of the program."""

from planner.planning.rides.boarded import with_planned_ride

__all__ = ["with_planned_ride"]
