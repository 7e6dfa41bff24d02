"""Free motions that keep clear of moving objects: detours around the space that an object takes up, and waits."""

from planner.planning.moving.avoided import clear_of_moving_objects

__all__ = ["clear_of_moving_objects"]
