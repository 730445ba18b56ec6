"""Files inside an FMU: libraries, the description of the variables, and documents."""
