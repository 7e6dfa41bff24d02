"""Robots of the command line: in files and in the catalogue."""
