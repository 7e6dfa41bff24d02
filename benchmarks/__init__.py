"""Measurements of the whole service: `python -m benchmarks http`."""
