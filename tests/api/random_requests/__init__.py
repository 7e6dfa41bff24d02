"""Random requests over what callers may ask for, and the answers held against it."""
