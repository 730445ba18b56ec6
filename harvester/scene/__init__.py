"""The input of the user: one device, its excitation and its load, with units.

As dataclasses and as TOML.
"""
