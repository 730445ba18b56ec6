"""The paper's averaging, its misprints corrected: harmonic decoupling of the voltage."""
