"""The power of a real device: its parameters scatter by class and by source, and its model has an error."""
