"""Excitation by name: densities of test standards, lines of machines and of walking, shocks."""
