"""The cost of accuracy in time: engines at many settings, their seconds against their errors."""
