"""The documentation: pages, and the tools that write some of them."""
