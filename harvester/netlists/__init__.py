"""Netlists as untrusted text: read, checked line by line, and made into the circuit of a load."""
