"""Derived robots: own limits, fixed joints, external axes in front of the base."""
