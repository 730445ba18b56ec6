"""The slow side: a store that charges over many vibrations, to which the rectifier's mean current matters."""
