"""Five-axis corner smoothing."""
