"""The page's source, what builds it with the package, and its tests in a browser."""
