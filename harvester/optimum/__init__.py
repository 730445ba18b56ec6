"""Where the power is largest: ranges of scene keys, the surface over them, its peaks, and intervals of both."""
