"""Evaluation of the recordings doctor: faults are put into clean recordings, and detections are counted."""
