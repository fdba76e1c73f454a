"""The recorder: writes everything that is published on the bus into a Rerun trace (docs/trace.md), or shows it live."""
