"""The certified plan and the reports made from it."""
