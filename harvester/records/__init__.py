"""The files of loggers and analysers: CSV files read, cleaned and described.

Excitation by the name of a profile.
"""
