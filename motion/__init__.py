"""Pure mathematics of movement: arrays in, arrays out; no clock, bus, file or MuJoCo."""
