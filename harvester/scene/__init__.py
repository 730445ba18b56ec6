"""What the user asks: one device, its shaking and its load, with units; as dataclasses and as TOML."""
