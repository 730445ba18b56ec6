"""Kernels of an FMU, a device that an importer advances, made of the package's own steps."""
