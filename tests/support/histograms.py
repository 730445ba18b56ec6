"""Densities of trajectories from several snapshots."""

from harvester.mechanics.ensemble.histograms import Histogram


def densities(trajectories, snapshots, spacing, **edges):
    """Densities of x, v and V (the keywords: edges of bins) from snapshots ``spacing`` apart; a group is a block."""
    histograms = {name: Histogram(values, trajectories.blocks) for name, values in edges.items()}
    for _ in range(snapshots):
        trajectories.run(spacing)
        for name, values in zip("xvV", trajectories.snapshot(), strict=True):
            if name in histograms:
                histograms[name].add(values)
    return {name: histogram.density() for name, histogram in histograms.items()}
