"""Numbers with their errors, and what makes the errors smaller."""
