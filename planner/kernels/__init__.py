"""Compiled kernels: the loops that numpy runs slowly, in C++ behind arrays (`planner/kernels/source/`)."""
