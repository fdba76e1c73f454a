"""Five strikes from one demonstration: played, reported and recorded."""
