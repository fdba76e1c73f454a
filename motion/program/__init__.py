"""The quadratic program: spline space, equalities, limit rows, PIQP, shortest durations, report."""
