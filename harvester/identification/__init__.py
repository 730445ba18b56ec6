"""From measurements at the bench to the parameters of a device, with intervals that hold them."""
