"""The version of the service."""

from importlib.metadata import PackageNotFoundError, version


def service_version() -> str:
    """Read the version of the installed package."""
    try:
        return version("trajectory-planner")
    except PackageNotFoundError:  # run from a checkout
        return "0+checkout"
