"""The command line is tried against the service that the tests of `api/` share."""

from tests.api.conftest import service as service
