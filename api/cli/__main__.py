"""`python -m api.cli` is `planner`."""

from api.cli import main

main()
