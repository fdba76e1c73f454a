"""The paper's experiments made anew: figures, a table of numbers, traces."""

import os

# Small matrices: threads of their own cost more than they bring, most of all beside other work.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
