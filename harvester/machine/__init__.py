"""The resources of the machine: cores, worker processes, files that are written whole, versions."""
