"""The processes. Each package composes `motion` and `protocol`; none imports another."""

import os

# A second BLAS thread only competes with the 1 kHz loops for the cores, and numpy reads this once, on import.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Nothing here draws with MuJoCo, and looking for a window system takes a fifth of a second of every start.
os.environ.setdefault("MUJOCO_GL", "disabled")
