"""Fixtures that test the command line against the shared service of the tests of `api/`."""

from tests.api.conftest import service as service
