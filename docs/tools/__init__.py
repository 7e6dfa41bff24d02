"""Tools that write pages of the documentation: `python -m docs.tools.figures`."""
