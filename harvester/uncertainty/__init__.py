"""Numbers with their errors, and the methods that reduce the errors."""
