"""What the machine gives: cores, worker processes, files written whole, versions."""
