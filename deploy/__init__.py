"""What is deployed: robots, bus configurations, and the table of processes."""
