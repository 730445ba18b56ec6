"""The paper's averaging, with its misprints corrected: the voltage of a harmonic motion, the law of the amplitude."""
