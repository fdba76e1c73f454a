"""What people run beside the services."""

import os

# A second BLAS thread competes with the loops for the cores, and on a busy machine learns twenty times more slowly.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
