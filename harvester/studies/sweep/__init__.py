"""Sweeps: points, tasks and who runs them, journal, table, dataset."""
