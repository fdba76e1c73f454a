"""The planner: learns primitives and turns goals into motions."""
