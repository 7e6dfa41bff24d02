"""`python -m cli` is `planner`."""

from cli import main

main()
