"""What loggers and analysers wrote: CSV files read, cleaned and described.

Shaking by the name of a profile.
"""
