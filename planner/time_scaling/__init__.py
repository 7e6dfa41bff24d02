"""The time scaling of a given path: how it is traversed as fast as its limits allow."""
