"""Tests of several machines in one world."""
