"""A device that is advanced from time to time by others: the kernels of an FMU, made of the package's own steps."""
