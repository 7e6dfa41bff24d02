"""The service under load, and what it adds to a plan."""
