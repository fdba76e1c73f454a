"""The doctor measured: faults put into clean recordings, and how many he finds."""
