"""Plans in a physics simulator: following errors and torques by back end."""
