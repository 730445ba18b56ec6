"""Physical quantities: units and prefixes, permitted kinds of numbers, spacings, preferred numbers of parts."""
