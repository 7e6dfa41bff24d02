"""Tests of collision-free paths around obstacles."""
