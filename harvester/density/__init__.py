"""The stationary density of mass, stop and resistor, solved without sampling: pure Python on NumPy and SciPy."""
