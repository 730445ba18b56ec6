"""Load circuits of ideal diodes and switches, solved in closed form beside the mass."""
