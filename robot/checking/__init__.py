"""What is wrong with a robot's description and its model, in sentences with a cure."""
