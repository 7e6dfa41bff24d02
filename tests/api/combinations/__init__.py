"""Plan requests that combine all that the schema offers, pairwise, each answer before the judges."""
