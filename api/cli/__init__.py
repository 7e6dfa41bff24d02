"""The command line `planner`."""

from api.cli.commands import app as app
