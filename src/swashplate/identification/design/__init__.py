"""What a maneuver would tell before it is flown, and the power that tells most."""
