"""How the storage capacitor charges from empty: when it reaches a voltage, and the power on the way."""
