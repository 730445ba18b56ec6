"""Physical quantities: units and prefixes, what a number may be, spacings, preferred numbers of parts."""
