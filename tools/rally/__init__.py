"""Rallies: the arm returns thrown balls to a target; returns are scored and recorded."""
