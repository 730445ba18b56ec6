"""The largest displacement, voltage and impact over a lifetime: by Rice's formula, or counted and extrapolated."""
