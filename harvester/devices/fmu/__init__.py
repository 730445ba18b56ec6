"""A scene's device as a functional mock-up unit (FMI), a part for simulators of machines."""
