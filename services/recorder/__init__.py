"""The recorder: writes all publications of the bus to a Rerun trace (docs/trace.md), or shows them live."""
