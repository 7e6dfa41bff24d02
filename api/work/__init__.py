"""What workers do: `execution.py` runs one task, `template.py` is what worker processes are forked from."""
