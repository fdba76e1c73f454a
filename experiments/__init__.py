"""The paper's experiments: figures, a table of numbers, traces."""

import os

# Matrices are small: BLAS threads cost more than they gain, especially beside other processes.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
