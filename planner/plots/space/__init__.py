"""Views of space: paths of tools, robots and what stands around them, looked at from somewhere."""

from planner.plots.space.space import VIEWS
from planner.plots.space.views import draw_path, draw_points, draw_postures, draw_robot

__all__ = ["VIEWS", "draw_path", "draw_points", "draw_postures", "draw_robot"]
