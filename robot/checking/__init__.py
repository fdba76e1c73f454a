"""Check a robot's description and model: each fault is a sentence with a cure."""
