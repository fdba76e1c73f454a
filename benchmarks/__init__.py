"""Volley's planner beside its peers and on the bus: `python -m benchmarks.planning`, `.latency` and `.memory`.

Everything runs on one BLAS thread, as the planner does.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
