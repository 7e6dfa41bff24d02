"""constraints.txt has a version of every distribution that the project may install."""

from __future__ import annotations

import tomllib
from importlib.metadata import PackageNotFoundError, requires, version

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.locations import ROOT


def installed_dependencies(requirements: list[str]) -> set[str]:
    """Follow requirements, and what they require in turn, as far as distributions are installed."""
    found: set[tuple[str, str]] = set()
    open_ends = [(text, "") for text in requirements]
    while open_ends:
        text, extra_asked = open_ends.pop()
        requirement = Requirement(text)
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": extra_asked}):
            continue
        name = canonicalize_name(requirement.name)
        try:
            version(name)
        except PackageNotFoundError:
            continue  # of an extra that is not installed here
        for extra in {"", *requirement.extras}:
            if (name, extra) not in found:
                found.add((name, extra))
                open_ends += [(inner, extra) for inner in requires(name) or ()]
    return {name for name, _ in found}


def test_every_installed_dependency_is_pinned() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = [
        *project["dependencies"],
        *(text for texts in project["optional-dependencies"].values() for text in texts),
    ]
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pinned = {canonicalize_name(line.partition("==")[0]) for line in lines if "==" in line}
    installed = installed_dependencies(wanted)
    assert len(installed) > 40
    assert installed - pinned - {"pip", "setuptools", "wheel"} == set()


def test_build_requirements_are_the_pinned_versions() -> None:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    requires_to_build = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["build-system"]["requires"]
    assert requires_to_build
    assert set(requires_to_build) <= set(lines)
