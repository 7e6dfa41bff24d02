"""The command line `planner`."""

from cli.commands import app as app
from cli.commands import main as main
