"""How power and voltage scatter over devices whose parts have tolerances: spreads, limits, yield and sensitivity."""
