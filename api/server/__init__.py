"""The server process: it answers HTTP, moves bytes between clients and workers, and looks after the workers."""
