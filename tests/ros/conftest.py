"""Fixtures that test the ROS 2 client against the shared service of the tests of `api/`."""

from tests.api.conftest import service as service
