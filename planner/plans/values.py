"""Values of the library as JSON, to the last bit, without code in it: frozen dataclasses, arrays and robot models."""

from __future__ import annotations

import math
from base64 import b64decode, b64encode
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from planner.robots.collision import kept_meshes
from planner.robots.collision.geometry import CollisionGeometry
from planner.robots.visuals import VisualGeometry

PACKAGE = __name__.partition(".")[0]
"""The package whose types a file may name."""

KINDS = "biuf"
"""The kinds of numbers in arrays: Booleans, integers and floating-point numbers."""

JOINTS = {"JointModelRZ": pin.JointModelRZ, "JointModelPZ": pin.JointModelPZ}
"""The joints of models, by Pinocchio's names."""


class Codec(NamedTuple):
    """The conversion of a type that is no dataclass, or whose fields are not all plain values.

    Attributes:
        type: The type.
        split: Return the parts of a value.
        join: Make a value of its parts.
    """

    type: type[Any]
    split: Callable[[Any], Any]
    join: Callable[..., Any]


def encode(value: Any) -> list[Any]:
    """Return a value as JSON: the entries of its parts, each part before the values that have it.

    A part that several values share has one entry, so it is shared again after `decode`.

    Raises:
        TypeError: A part is not of the library, such as a constraint of your own.
    """
    writer = _Writer()
    writer.entries.append(writer.plain(value))
    return writer.entries


def decode(entries: list[Any]) -> Any:
    """Return the value of the entries that `encode` wrote.

    Raises:
        ValueError: An entry is malformed, or of a type or field that this version of the library does not have.
    """
    values: list[Any] = []
    for entry in entries:
        try:
            values.append(_value(entry, values))
        except Exception as error:  # noqa: BLE001 - malformed parts make the constructors of any type fail
            raise ValueError(f"entry {len(values)}: {error}") from None
    return values[-1]


class _Writer:
    """The entries of the parts written so far.

    Attributes:
        entries: The entries.
    """

    def __init__(self) -> None:
        self.entries: list[Any] = []
        self._written: dict[int, tuple[Any, int]] = {}  # by identity; the part is kept, so that no other gets its own

    def plain(self, value: Any) -> Any:
        """Return a value in JSON, with references to the entries of its parts."""
        if isinstance(value, np.generic):
            value = value.item()
        if isinstance(value, float) and not math.isfinite(value):
            return {"float": str(value)}
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if type(value) is tuple:
            return [self.plain(item) for item in value]
        if id(value) not in self._written:
            entry = self._entry(value)
            self._written[id(value)] = value, len(self.entries)
            self.entries.append(entry)
        return {"entry": self._written[id(value)][1]}

    def _entry(self, value: Any) -> dict[str, Any]:
        name = next((name for name, codec in CODECS.items() if isinstance(value, codec.type)), None)
        if name is not None:
            return {name: [self.plain(part) for part in CODECS[name].split(value)]}
        cls = type(value)
        name = f"{cls.__module__}.{cls.__qualname__}"
        if find_type(name) is not cls:
            raise TypeError(f"{name} is no type of {PACKAGE}")
        return {"type": name, "parts": {part: self.plain(getattr(value, part)) for part in _parts_of(cls) or ()}}


def _value(entry: Any, values: list[Any]) -> Any:
    """Return the value of an entry, whose parts stand before it."""
    if isinstance(entry, list):
        return tuple(_value(item, values) for item in entry)
    if not isinstance(entry, dict):
        return entry
    match entry:
        case {"entry": int(number)} if 0 <= number < len(values):
            return values[number]
        case {"float": str(text)}:
            return float(text)
        case {"type": str(name), "parts": dict(parts)}:
            if (cls := find_type(name)) is None:
                raise ValueError(f"{name} is no type of this version of {PACKAGE}")
            unknown = sorted(set(parts) - set(_parts_of(cls) or ()))
            if unknown:
                raise ValueError(f"{name} has no {', '.join(unknown)}")
            return cls(**{part: _value(value, values) for part, value in parts.items()})
    ((name, parts),) = entry.items()
    return CODECS[name].join(*_value(parts, values))


def find_type(name: str) -> type[Any] | None:
    """Return the type of the library with this full name; None: there is none whose values can be written."""
    module, _, own = name.rpartition(".")
    if module.partition(".")[0] != PACKAGE:
        return None
    try:
        found = getattr(import_module(module), own, None)
    except ImportError:
        return None
    return found if isinstance(found, type) and found.__module__ == module and _parts_of(found) is not None else None


def _parts_of(cls: type[Any]) -> tuple[str, ...] | None:
    """Return the names of the fields of a frozen dataclass or a named tuple; None: it is neither."""
    if is_dataclass(cls) and cls.__dataclass_params__.frozen:  # type: ignore[attr-defined]
        return tuple(field.name for field in fields(cls) if field.init)
    return getattr(cls, "_fields", None) if issubclass(cls, tuple) else None


def _array(kind: str, shape: tuple[int, ...], content: str) -> np.ndarray:
    dtype = np.dtype(kind)
    if dtype.kind not in KINDS:
        raise ValueError(f"arrays of {kind} are not read")
    return np.frombuffer(b64decode(content), dtype).reshape(shape).copy()


def _split_array(array: np.ndarray) -> tuple[Any, ...]:
    if array.dtype.kind not in KINDS:
        raise TypeError(f"an array of {array.dtype} cannot be written")
    little = array.astype(array.dtype.newbyteorder("<"))
    return little.dtype.str, little.shape, b64encode(little.tobytes()).decode()


def _split_model(model: pin.Model) -> tuple[Any, ...]:
    """Return name, gravity, joints and frames of a model."""
    joints = zip(
        (joint.shortname() for joint in model.joints.tolist()),
        model.parents.tolist(),
        model.jointPlacements.tolist(),
        model.names.tolist(),
        model.inertias.tolist(),
        strict=True,
    )
    frames = (
        (frame.name, frame.parentJoint, frame.parentFrame, frame.placement, frame.type.name, frame.inertia)
        for frame in model.frames.tolist()[1:]
    )
    return model.name, model.gravity.vector, tuple(joints), tuple(frames)


def _model(name: str, gravity: np.ndarray, joints: tuple[Any, ...], frames: tuple[Any, ...]) -> pin.Model:
    model = pin.Model()
    model.name, model.gravity.vector = name, gravity
    for number, (kind, parent, placement, own, inertia) in enumerate(joints):
        if number:
            if not 0 <= parent < number:
                raise ValueError(f"joint {number} follows joint {parent}")
            model.addJoint(parent, JOINTS[kind](), placement, own)
        model.inertias[number] = inertia
    for own, joint, frame, placement, kind, inertia in frames:
        if not (0 <= joint < model.njoints and 0 <= frame < model.nframes):
            raise ValueError(f"the frame {own} is on joint {joint} and frame {frame}")
        model.addFrame(pin.Frame(own, joint, frame, placement, getattr(pin.FrameType, kind), inertia), False)
    return model


def _inertia(mass: float, lever: np.ndarray, inertia: np.ndarray) -> pin.Inertia:
    body = pin.Inertia.Zero()
    body.mass, body.lever, body.inertia = mass, lever, inertia
    return body


def _split_geometry(geometry: CollisionGeometry) -> tuple[Any, ...]:
    """Return the fields, with the convex pieces of meshes in place of the function that finds them."""
    own = {field.name: getattr(geometry, field.name) for field in fields(geometry) if field.name != "meshes"}
    return own, geometry.pieces


CODECS = {
    "array": Codec(np.ndarray, _split_array, _array),
    "list": Codec(list, tuple, lambda *items: list(items)),
    "set": Codec(frozenset, lambda items: sorted(items), lambda *items: frozenset(items)),
    "mapping": Codec(Mapping, lambda value: value.items(), lambda *pairs: dict(pairs)),
    "placement": Codec(pin.SE3, lambda value: (value.rotation, value.translation), pin.SE3),
    "inertia": Codec(pin.Inertia, lambda value: (value.mass, value.lever, value.inertia), _inertia),
    "model": Codec(pin.Model, _split_model, _model),
    "shapes": Codec(
        CollisionGeometry, _split_geometry, lambda own, pieces: CollisionGeometry(**own, meshes=kept_meshes(pieces))
    ),
    "visuals": Codec(VisualGeometry, lambda _: (), VisualGeometry),  # a plan is no archive of meshes to look at
}
"""The conversions of types that are no dataclass with plain fields, by the names of their entries."""
