"""How ngspice is built from its source with nothing but packages of the Python index: no make, no shell, no root."""
