"""One thread for linear algebra, as in the services: on a busy machine several wait for each other for minutes."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy is loaded
