"""Tasks in any order, beside orders by distance."""
