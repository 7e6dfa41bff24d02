"""Tests of the ways around obstacles."""
