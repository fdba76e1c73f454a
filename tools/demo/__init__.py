"""The demo: five strikes from one demonstration, reported and recorded."""
