"""The input of the user: one device, its excitation and its load, with units; as dataclasses and as TOML."""
