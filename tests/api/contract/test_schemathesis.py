"""Requests made up from the OpenAPI document, valid and invalid: no 5xx, and every answer as documented."""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING, Any

import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis.errors import FlakyStrategyDefinition
from schemathesis.checks import CHECKS
from schemathesis.config import SchemathesisConfig

from api.contract.parts.common import LARGEST
from tests.api.conftest import running_service
from tests.api.operations import OPERATIONS, Operation
from tests.sizes import HTTP

if TYPE_CHECKING:
    from collections.abc import Iterator

VALID, INVALID = schemathesis.GenerationMode.POSITIVE, schemathesis.GenerationMode.NEGATIVE
CASES = [(operation, VALID) for operation in OPERATIONS] + [(op, INVALID) for op in OPERATIONS if op.request]
OF_A_TIME = ["use_after_free", "ensure_resource_availability"]
"""Checks that compare answers: a cancelled batch is still there, and so is its robot's content."""

REJECTIONS = ["400", "404", "405", "406", "409", "413", "415", "422", "429", "5xx"]
"""Statuses that may answer an invalid request: a list that is too long may also make the body too large."""

STEPS = 6
"""The requests of a chain, each of which may use earlier answers."""

BUDGET = settings(
    max_examples=max(HTTP, 1),  # Hypothesis takes no 0, the number of the quick size, which leaves these tests out
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large],
)


@pytest.fixture(scope="module")
def openapi(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Of a service of its own: the robots that are made up stay there."""
    with running_service(tmp_path_factory.mktemp("made_up") / "log.jsonl") as service:
        checks = {"negative_data_rejection": {"expected-statuses": REJECTIONS}}
        config = SchemathesisConfig.from_dict({"checks": checks})
        yield schemathesis.openapi.from_url(f"{service.url}/openapi.json", config=config)


def with_a_patient_deadline(case: schemathesis.Case) -> None:
    """Set a long deadline, since a valid deadline of a nanosecond gives an uninformative 504."""
    deadline = case.body.get("deadline") if isinstance(case.body, dict) else None
    if isinstance(deadline, int | float) and 0.0 < deadline <= LARGEST:
        case.body["deadline"] = 10.0


@pytest.mark.large_only
@pytest.mark.parametrize(
    ("operation", "mode"), CASES, ids=[f"{operation.id}-{mode.value}" for operation, mode in CASES]
)
def test_made_up_requests(openapi: Any, operation: Operation, mode: schemathesis.GenerationMode) -> None:
    # What is valid by the document may still contradict the robot: that 422 is no rejection of valid data.
    # What is wrong with a request of a batch is told among its results.
    ignored = ["positive_data_acceptance", *(["negative_data_rejection"] if operation.id == "create_batch" else [])]
    excluded = CHECKS.get_by_names(ignored)

    @BUDGET
    @given(case=openapi[operation.path][operation.method].as_strategy(generation_mode=mode))
    def check(case: schemathesis.Case) -> None:
        with_a_patient_deadline(case)
        case.call_and_validate(excluded_checks=excluded, timeout=30)

    check()


@pytest.mark.large_only
def test_chains_of_made_up_requests(openapi: Any) -> None:
    """Robots and batches are made, looked at, used and deleted, in any order, by the links of the document."""
    machine = openapi.as_state_machine()
    excluded = ["positive_data_acceptance", "negative_data_rejection", *OF_A_TIME]
    # OpenAPI 3.1 has no words for a stream of events: the schema of the whole, a text, is held against each.
    of_events = [*excluded, "response_schema_conformance"]
    failures: list[Exception] = []

    class Chains(machine):  # type: ignore[misc]
        tried = 0

        def setup(self) -> None:
            Chains.tried += 1

        def before_call(self, case: schemathesis.Case) -> None:
            with_a_patient_deadline(case)

        def validate_response(self, response: Any, case: schemathesis.Case, **options: Any) -> None:
            names = of_events if case.path.endswith("/events") else excluded
            try:
                case.validate_response(response, excluded_checks=CHECKS.get_by_names(names))
            except Exception as failure:
                failures.append(failure)
                raise

    for chance in count():
        left = settings(BUDGET, max_examples=HTTP - Chains.tried, stateful_step_count=STEPS, phases=[Phase.generate])
        try:
            seed(chance)(Chains).run(settings=left)
            break
        except FlakyStrategyDefinition:
            # What follows a request depends on its answer, such as that of a batch that is done or not yet: Hypothesis
            # gives up where it differs from what it was before.
            if failures or Chains.tried >= HTTP:
                break
    assert not failures, failures[0]
    assert Chains.tried >= HTTP
