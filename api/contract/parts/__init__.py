"""Schemas that several requests or answers have in common."""
