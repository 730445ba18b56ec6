"""The part that is ngspice's own: the library, the deck that it runs, the callbacks, and its messages."""
