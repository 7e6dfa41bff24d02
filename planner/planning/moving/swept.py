"""The space that moving objects take up in an interval of time, as static objects."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from planner.scene.scene import Scene, SceneObject
from planner.shapes import Shape

FARTHEST_BETWEEN = 0.02
"""The largest distance, m, of a point of a moving object from its place on the nearest copy, where copies suffice."""

MOST_COPIES = 32
"""The most copies of a moving object that stand for the space it takes up."""


def with_swept(scene: Scene, things: Iterable[SceneObject], begin: float, end: float) -> Scene:
    """Return a scene with static copies of moving objects, all over an interval of time, s.

    A robot that keeps clear of all copies keeps clear of the objects in that interval. The margin of a copy is larger
    by the largest distance of a point of the object from its place on the nearest copy.

    Args:
        scene: The scene.
        things: The objects that get copies.
        begin: When the interval begins, s.
        end: When it ends, s.
    """
    objects, allowed, margins = list(scene.objects), list(scene.allowed_pairs), list(scene.pair_margins)
    for thing in things:
        for copy, gap in _copies(thing, begin, end):
            own = scene.margin if thing.margin is None else thing.margin
            objects.append(replace(copy, margin=own + gap))
            others = ({*pair} - {thing.id} for pair in scene.allowed_pairs if thing.id in pair)
            allowed += [(name, copy.id) for other in others for name in other]
            margins += [(body, copy.id, least + gap) for body, name, least in scene.pair_margins if name == thing.id]
    return replace(scene, objects=objects, allowed_pairs=allowed, pair_margins=margins)


def _copies(thing: SceneObject, begin: float, end: float) -> Iterator[tuple[SceneObject, float]]:
    """Yield copies of a moving object, and the largest distance of its points from the nearest copy, m."""
    legs = [] if thing.motion is None else list(thing.motion.legs(thing.pose))
    reach = max((_reach(shape) for shape in thing.shapes if isinstance(shape, Shape)), default=0.0)
    speeds = [
        float(np.linalg.norm(leg.velocity) + reach * np.linalg.norm(leg.spin))
        for leg in legs
        if leg.begin < end and leg.end > begin
    ]
    way = max(speeds, default=0.0) * (end - begin)
    count = min(max(1, int(np.ceil(way / (2.0 * FARTHEST_BETWEEN)))), MOST_COPIES)
    step = (end - begin) / count
    for k, time in enumerate((begin + (np.arange(count) + 0.5) * step).tolist()):
        name = f"{thing.id} at {time:.6g} s ({k})"
        yield replace(thing, id=name, pose=thing.pose_at(time), motion=None), way / count / 2.0


def _reach(shape: Shape) -> float:
    """Return a distance from the origin, m, beyond which a bounded shape has no point."""
    axes = np.vstack([np.eye(3), -np.eye(3)])
    extents = np.abs(shape.support(axes)).reshape(2, 3).max(axis=0)
    return float(np.linalg.norm(extents))
