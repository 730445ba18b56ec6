"""What the machine gives: cores, worker processes, files that are written whole, versions."""
