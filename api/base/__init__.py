"""What every other layer stands on: errors and their documents, settings, bounds on sizes, logs."""
