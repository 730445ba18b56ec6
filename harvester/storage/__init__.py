"""The slow side: storage that charges over many vibrations, to which the rectifier's mean current matters."""
