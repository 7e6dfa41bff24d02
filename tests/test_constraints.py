"""constraints.txt has a version of every distribution that the project may install."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import PackageNotFoundError, requires, version

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.locations import ROOT


def installed_dependencies(requirements: list[str]) -> set[str]:
    """Return the installed distributions among requirements and their own requirements."""
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


EXTRAS_OF_THE_IMAGE = ("robots", "postgresql", "cluster", "otel")
PINNED_WITH_HASHES = re.compile(r"([A-Za-z0-9._-]+==[0-9][0-9a-z.]*)((?: --hash=sha256:[0-9a-f]{64}){1,2})")


def locked(name: str) -> set[str]:
    """Return the pinned packages of a list of the image: each has one or two hashes."""
    text = (ROOT / "locks" / f"{name}.txt").read_text(encoding="utf-8").replace(" \\\n   ", "")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    found = [PINNED_WITH_HASHES.fullmatch(line) for line in lines]
    assert lines
    assert None not in found
    return {match[1] for match in found if match}


def test_the_hashes_of_the_image_are_those_of_the_pinned_versions() -> None:
    """`.ci/lock` writes the lists anew."""
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pinned = {(canonicalize_name(name), version) for name, _, version in (line.partition("==") for line in lines)}
    for name in ("build", "service", *EXTRAS_OF_THE_IMAGE):
        found = {
            (canonicalize_name(name), version) for name, _, version in (pin.partition("==") for pin in locked(name))
        }
        assert found <= pinned, name


def test_the_image_has_a_hash_of_every_package_that_it_installs() -> None:
    document = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    of_service = document["project"]["dependencies"]
    wanted = {"build": document["build-system"]["requires"], "service": of_service}
    extras = document["project"]["optional-dependencies"]
    wanted |= {extra: [*of_service, *extras[extra]] for extra in EXTRAS_OF_THE_IMAGE}
    for name, requirements in wanted.items():
        pins = locked(name) | (locked("service") if name in EXTRAS_OF_THE_IMAGE else set())
        known = {canonicalize_name(pin.partition("==")[0]) for pin in pins}
        assert {canonicalize_name(Requirement(text).name) for text in requirements} <= known, name
        assert installed_dependencies(requirements) <= known, name


def test_the_image_installs_packages_by_hash_only() -> None:
    lines = (ROOT / "Dockerfile").read_text(encoding="utf-8").replace("\\\n", " ").splitlines()
    installs = [text for line in lines if line[:1] != "#" for text in re.findall(r"pip install[^&|]*", line)]
    assert len(installs) == 3
    assert all("--require-hashes" in line or "--no-index" in line for line in installs)
