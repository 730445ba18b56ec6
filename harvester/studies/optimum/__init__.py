"""Where the power is largest: ranges of scene keys, evaluations, response surface, peaks with intervals."""
