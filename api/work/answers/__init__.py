"""The forms of answers, and which of them a caller wants."""
