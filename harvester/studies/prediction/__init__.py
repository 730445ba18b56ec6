"""The power of a real device, whose parameters scatter and whose model has an error."""
