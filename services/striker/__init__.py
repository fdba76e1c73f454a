"""The striker: sees the ball, predicts it, chooses a hit, asks the planner for it, and corrects it until the touch."""
