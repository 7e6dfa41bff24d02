"""Roadmaps: built, proved again where a scene changes, and searched."""
