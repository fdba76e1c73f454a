"""The doctor: find the faults of a recording, and repair those whose repair is safe."""

from tools.recordings.doctor.examination import examine
from tools.recordings.doctor.finding import Arm, Examination, Finding, Robot

__all__ = ["Arm", "Examination", "Finding", "Robot", "examine"]
