"""Plans in a physics simulator."""
