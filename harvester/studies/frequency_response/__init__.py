"""Voltage and power of a harmonically driven scene against the frequency."""
