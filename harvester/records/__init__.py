"""What loggers and analysers wrote: CSV files read, cleaned and described; shaking by the name of a profile."""
