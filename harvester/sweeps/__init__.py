"""What `harvester.studies.sweep` is made of: points, tasks and who runs them, journal, table, dataset."""
