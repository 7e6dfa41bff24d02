"""The command line `planner`."""

from api.cli.commands import app as app
from api.cli.commands import main as main
