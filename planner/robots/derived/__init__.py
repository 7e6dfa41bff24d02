"""What an owner makes of a robot: own limits, joints held still, external axes in front of the base."""
