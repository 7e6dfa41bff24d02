"""Batches: thousands of plan requests at once, which arrive, are worked on behind other requests, and are read."""
