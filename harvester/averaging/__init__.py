"""Stochastic averaging: pure Python on NumPy and SciPy; neither numba nor PySpice."""
