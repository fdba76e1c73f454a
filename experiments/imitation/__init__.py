"""Imitation in position: how near plans come to recordings, the numbers and pictures of docs/imitation.md."""
