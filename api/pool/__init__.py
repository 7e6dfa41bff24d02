"""The worker processes, the queue for them and the costs of tasks; no HTTP, no database, no robotics."""
