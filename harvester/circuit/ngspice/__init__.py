"""ngspice itself: the library, the deck that it runs, the callbacks, and what its messages mean."""
