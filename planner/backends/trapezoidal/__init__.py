"""The back end that accelerates, cruises and brakes."""
