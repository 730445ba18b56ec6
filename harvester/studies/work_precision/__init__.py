"""What accuracy costs in time: engines at many settings, their seconds against their errors."""
