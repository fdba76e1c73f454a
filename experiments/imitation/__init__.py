"""Imitation in position: the distance of plans from recordings, the numbers and figures of docs/imitation.md."""
