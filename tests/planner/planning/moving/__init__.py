"""Tests of free motions beside moving objects."""
