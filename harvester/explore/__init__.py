"""The page of `harvester explore`: a device's sliders, its power as they turn, and runs in the background."""
