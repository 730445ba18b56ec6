"""The files of loggers and analysers: CSV files read, cleaned and described.

Shaking by the name of a profile.
"""
