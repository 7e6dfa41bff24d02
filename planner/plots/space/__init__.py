"""Views of space: paths of tools, robots and their surroundings."""
