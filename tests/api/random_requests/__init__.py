"""Random requests over all fields that callers may use, and checks of the answers against the requests."""
