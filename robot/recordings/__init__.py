"""Plausibility of a recording for an arm, and warnings about it, in sentences."""
