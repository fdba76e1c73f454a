"""The cache of results, bounded in bytes."""

import numpy as np

from motion.program.cache import cached_within, size_of
from motion.program.space import make_space


def test_the_least_recently_used_result_is_evicted() -> None:
    made: list[int] = []

    @cached_within(2_000)
    def zeros(count: int) -> np.ndarray:
        made.append(count)
        return np.zeros(count)

    assert zeros(100) is zeros(100)
    zeros(120)
    zeros(100)
    zeros(110)  # 800 + 960 + 880 bytes: the result for 120 is evicted
    zeros(100)
    assert made == [100, 120, 110]
    zeros(120)
    assert made == [100, 120, 110, 120]


def test_a_result_larger_than_the_cache_is_kept_alone() -> None:
    @cached_within(10)
    def zeros(count: int) -> np.ndarray:
        return np.zeros(count)

    assert zeros(100) is zeros(100)


def test_size_is_the_sum_of_all_arrays() -> None:
    space = make_space(20, 0.0)
    names = "factor", "whitening", "control_points", "drift"
    assert size_of(space) == sum(getattr(space, name).nbytes for name in names)
    assert size_of([np.zeros(2), (np.zeros(3), 1)]) == 40
