"""From schemas to the library's values; only workers load this."""
