"""Tests of the corpus of jobs, and of the runner of its benchmark."""
