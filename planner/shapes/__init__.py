"""Convex shapes, of which robots and the things around them are made: supports, bounds and checked numbers."""

from planner.shapes.hulls import ConvexHull
from planner.shapes.primitives import Box, Capsule, Cylinder, HalfSpace, Sphere
from planner.shapes.shape import BoundingCapsule, InvalidShape, Shape
from planner.shapes.surfaces import surface

__all__ = [
    "BoundingCapsule",
    "Box",
    "Capsule",
    "ConvexHull",
    "Cylinder",
    "HalfSpace",
    "InvalidShape",
    "Shape",
    "Sphere",
    "surface",
]
