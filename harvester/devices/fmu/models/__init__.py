"""Models of `cosimulate` as FMUs."""
