"""The doctor: what is wrong with a recording, in sentences, and the recording with what is safe to repair repaired."""

from tools.recordings.doctor.examination import examine
from tools.recordings.doctor.finding import Arm, Examination, Finding, Robot

__all__ = ["Arm", "Examination", "Finding", "Robot", "examine"]
