"""Five strikes from one demonstration, in real time, reported and recorded."""
