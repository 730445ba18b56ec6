"""The page of `harvester explore`: a device's knobs, its power as they turn, and runs in the background."""
