"""From a requirement to a decision: circuit, parts and capacitor, and how many devices meet it."""
