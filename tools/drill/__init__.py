"""The drill: cause every fault that Volley claims to survive, and compare the measured reaction with its bounds."""
