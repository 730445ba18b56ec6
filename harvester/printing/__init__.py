"""How answers are printed: their units, and tables on a terminal and in a notebook."""
