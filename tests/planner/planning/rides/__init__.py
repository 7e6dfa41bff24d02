"""Tests of rides on moving objects."""
