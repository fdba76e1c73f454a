"""Programs for users: the shell command, recordings, the demo, the drill, and generated pages."""

import os

# A second BLAS thread competes with the loops for the cores; on a busy machine it makes learning 20 times slower.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
