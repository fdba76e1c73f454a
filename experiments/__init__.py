"""The paper's experiments made anew: figures, a table of numbers, traces."""
