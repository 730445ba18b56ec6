"""The top Lyapunov exponent of rest, and the region in which it is stable."""
