"""The doctor: find the faults of a recording, and repair those that are safe to repair."""

from tools.recordings.doctor.examination import examine
from tools.recordings.doctor.finding import Arm, Examination, Finding, Robot

__all__ = ["Arm", "Examination", "Finding", "Robot", "examine"]
