"""Kernels of an FMU of a model of the user's own: the lock-step without ngspice."""
