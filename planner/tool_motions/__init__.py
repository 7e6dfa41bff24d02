"""Motions of the tool, lines and circles, followed with the joints."""
