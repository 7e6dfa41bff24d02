"""No certificate depends on the exact value of an accuracy constant: each is halved or doubled (in soaks both)."""

from __future__ import annotations

import sys
from importlib import import_module
from itertools import product

import pytest

from benchmarks.corpus.corpus import job, plan_job
from docs.tools.constants import Constant, accuracies, library
from tests.sizes import NAME, diagonal

PLANS = {
    "seam_arc-00-kuka_kr16_l6_2": ("cubic", "quintic", "trapezoidal", "ruckig", "toppra"),
    "seam_weave-00-kuka_kr16_l6_2": ("ruckig", "toppra_jerk_limited"),
    "inspection-00-kuka_kr16_l6_2": ("auto", "min_effort"),
    "pick_and_place-00-kuka_kr16_l6_2": ("toppra",),
}
"""Jobs, and the back ends that plan them."""

FACTORS = (0.5, 2.0)


def change(constant: Constant, factor: float, patch: pytest.MonkeyPatch) -> int:
    """Multiply a constant in every module that has it; return their number."""
    module = import_module(constant.file.removesuffix(".py").replace("/", ".").removesuffix(".__init__"))
    value = getattr(module, constant.name)
    having = [
        other
        for name, other in sorted(sys.modules.items())
        if name.startswith("planner.") and vars(other).get(constant.name) is value
    ]
    for other in having:
        patch.setattr(other, constant.name, factor * value)
    return len(having)


def plan_all() -> None:
    for name, kinds in PLANS.items():
        for kind in kinds:
            checked = plan_job(job(name), kind).certificate
            assert checked.satisfied, f"{name} by {kind}"


@pytest.fixture(scope="module")
def _loaded() -> None:
    """Load every module that plans need."""
    plan_all()


@pytest.mark.large_only
@pytest.mark.parametrize(
    ("constant", "factor"),
    product(accuracies(library()), FACTORS) if NAME == "soak" else diagonal(accuracies(library()), FACTORS),
    ids=lambda value: f"{value.file}-{value.name}" if isinstance(value, Constant) else None,
)
@pytest.mark.usefixtures("_loaded")
def test_plans_are_certified_with_half_and_double_of_an_accuracy(
    constant: Constant, factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert change(constant, factor, monkeypatch) >= 1
    plan_all()


@pytest.mark.large_only
def test_a_change_reaches_every_module_that_imports_the_constant(monkeypatch: pytest.MonkeyPatch) -> None:
    from planner import tolerances
    from planner.certificate import checks

    (constant,) = (found for found in accuracies(library()) if found.name == "LIMIT_TOLERANCE")
    assert vars(checks)["LIMIT_TOLERANCE"] == tolerances.LIMIT_TOLERANCE
    assert change(constant, 2.0, monkeypatch) > 2
    assert vars(checks)["LIMIT_TOLERANCE"] == tolerances.LIMIT_TOLERANCE == 2e-9
