"""The service under load, and its overhead for a plan."""
