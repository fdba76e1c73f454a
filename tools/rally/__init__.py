"""Rallies: an arm returns thrown balls to a target, or two arms play with each other; scored and recorded."""
