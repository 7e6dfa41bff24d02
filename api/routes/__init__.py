"""The endpoints: they move bytes between the caller, the store and the workers."""
