"""The doctor: finds faults of a recording, describes each in a sentence, and repairs those that are safe to repair."""

from tools.recordings.doctor.examination import examine
from tools.recordings.doctor.finding import Arm, Examination, Finding, Robot

__all__ = ["Arm", "Examination", "Finding", "Robot", "examine"]
