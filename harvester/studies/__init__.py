"""The studies of a scene: sweeps, comparisons, the best load, stability, frequency response, a path."""
