"""What tests of motion share beside their fixtures: the type of `ask`, and a free value of one joint."""

from collections.abc import Callable

import numpy as np

from motion.request import MotionRequest

Ask = Callable[..., MotionRequest]
"""The fixture `ask`: makes a request of one joint."""

FREE = np.full(1, np.nan)
"""A value that the request leaves to the plan."""
