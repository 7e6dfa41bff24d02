"""Settings of the whole suite, and its report at the end."""

from __future__ import annotations

import os
from collections import Counter, defaultdict
from typing import TYPE_CHECKING

import pytest
from hypothesis import HealthCheck, settings
from xdist.scheduler import LoadScopeScheduling

from planner.errors import UnknownRobot
from tests.api.conftest import RunningService, running_service, stored
from tests.robots_extra import is_extra_installed, lacks_extra
from tests.sizes import LARGER, NAME, SIZE, SIZES, chosen_rows

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator

    from xdist.remote import Producer

# Each start of a service compiles 1 s long otherwise.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# The same cases each time, so that what passes here passes in CI; a soak tries new ones.
settings.register_profile(
    "sized",
    max_examples=SIZE.examples,
    deadline=None,
    derandomize=NAME != "soak",
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("sized")

SLOWEST_FILES = 10
ONE_BY_ONE = {"tests/api/contract/test_schemathesis.py", "tests/cli/test_demo.py"}


@pytest.fixture(scope="session")
def _shared_service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[RunningService, set[str]]]:
    """Start the service of all tests; return also the paths of its first robots and scenes."""
    with running_service(tmp_path_factory.mktemp("service") / "log.jsonl") as running:
        yield running, stored(running)


@pytest.fixture(scope="module")
def service(_shared_service: tuple[RunningService, set[str]]) -> Iterator[RunningService]:
    """One service for all tests; the robots and scenes of a module are deleted, since other tests list them."""
    running, first = _shared_service
    yield running
    for path in stored(running) - first:
        running.client.delete(path)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print where the time went, and the cases that this size leaves to a larger one."""
    seconds: Counter[str] = Counter()
    for reports in terminalreporter.stats.values():
        for report in reports:
            if hasattr(report, "duration"):
                seconds[report.location[0]] += report.duration
    terminalreporter.section("where the time went")
    shown = ", ".join(f"{file} {spent:.0f} s" for file, spent in seconds.most_common(SLOWEST_FILES))
    terminalreporter.line(f"{sum(seconds.values()):.0f} s of tests: {shown}")
    if NAME == "quick":
        now, ci = SIZES["quick"], SIZES["large"]
        terminalreporter.line(
            f"left to CI (TEST_SIZE=large pytest -m {LARGER!r}): {ci.requests} random requests a back end "
            f"instead of {now.requests}, {ci.examples} cases a property instead of {now.examples}, "
            f"{ci.http} made-up HTTP requests an operation instead of {now.http}, "
            f"{ci.over_fields} random ones over all fields instead of {now.over_fields}, "
            f"all jobs of the suite and all cases of long tables instead of one in {now.one_in}, "
            "and faults that take services down, and searches that take seconds"
        )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep one case in `SIZE.one_in` of a test marked `long_table`, and none of one marked `large_only`."""
    left_out = {item for item in items if NAME == "quick" and item.get_closest_marker("large_only")}
    tables: dict[str, list[pytest.Item]] = defaultdict(list)
    for item in items:
        if item.get_closest_marker("long_table") and item not in left_out:
            tables[item.nodeid.partition("[")[0]].append(item)
    left_out |= {
        item for table in tables.values() for row, item in enumerate(table) if row not in chosen_rows(len(table))
    }
    config.hook.pytest_deselected(items=list(left_out))
    items[:] = [item for item in items if item not in left_out]


class FileScheduling(LoadScopeScheduling):
    """Gives each process one file after the other, so that tests of a file share their fixtures.

    At larger sizes, where tests take long that share nothing, each goes anywhere.
    """

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.partition("::")[0]
        return file if NAME == "quick" or file in ONE_BY_ONE else nodeid


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> FileScheduling:
    """Distribute tests over processes; groups by marks (`--dist=loadgroup`) do nothing with pytest 9.2."""
    return FileScheduling(config, log)


@pytest.hookimpl(wrapper=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> Generator[None, object, object]:
    """Skip a test that loads a robot of the extra `robots` where that is not installed."""
    try:
        return (yield)
    except UnknownRobot as error:
        if not lacks_extra(error, is_installed=is_extra_installed()):
            raise
        pytest.skip("the extra `robots` is not installed")
