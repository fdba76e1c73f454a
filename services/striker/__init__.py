"""The striker: follow the ball, choose a hit, request it from the planner, and correct it until the touch."""
