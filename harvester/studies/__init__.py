"""What one asks of scenes and engines: sweeps, comparisons, the best load, stability, frequency response, a path.

The public functions of the same names are `harvester.studies.sweep.public`, `harvester.compare` and so on.
"""
