"""The parts of the package toppra in use, imported without matplotlib, which takes 30 MB and half a second.

The import takes half a second and 50 MB of memory, scipy's splines included. Only planning imports this module.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from types import ModuleType
from typing import Any


class _PlotsWhenUsed(ModuleType):
    """A stand-in for matplotlib.pyplot, which imports it when something of it is used."""

    def __getattr__(self, name: str) -> Any:
        """Return what matplotlib.pyplot has."""
        return getattr(import_module("matplotlib.pyplot"), name)


@contextmanager
def _without_matplotlib() -> Iterator[None]:
    """Delay the import of matplotlib.pyplot, by modules imported meanwhile, until they plot."""
    if "matplotlib" in sys.modules:
        yield
        return
    parent, plots = ModuleType("matplotlib"), _PlotsWhenUsed("matplotlib.pyplot")
    parent.pyplot = plots  # type: ignore[attr-defined] # as the import of a submodule does
    sys.modules |= {"matplotlib": parent, "matplotlib.pyplot": plots}
    try:
        yield
    finally:
        del sys.modules["matplotlib"], sys.modules["matplotlib.pyplot"]


with _without_matplotlib():
    from toppra.algorithm import TOPPRA
    from toppra.algorithm.reachabilitybased.reachability_algorithm import ReachabilityAlgorithm
    from toppra.constraint import LinearConstraint
    from toppra.exceptions import ToppraError
    from toppra.interpolator import AbstractGeometricPath
    from toppra.solverwrapper import seidelWrapper

__all__ = [
    "TOPPRA",
    "AbstractGeometricPath",
    "LinearConstraint",
    "ReachabilityAlgorithm",
    "ToppraError",
    "seidelWrapper",
]
