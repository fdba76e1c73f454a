"""Measurements of speed: `python -m benchmarks.planning`, `.latency`, `.memory` and others; see README.md.

Everything runs on one BLAS thread, as the planner does.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
