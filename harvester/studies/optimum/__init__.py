"""The search for the largest power: ranges of scene keys, evaluations, response surface, peaks with intervals."""
