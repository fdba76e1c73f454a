"""Check whether a machine can control an arm at 1 kHz, before it moves one."""
