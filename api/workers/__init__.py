"""What worker processes are forked from, and how they run one task."""
