"""The tasks of workers by subject: each function is registered under the id of its operation."""
