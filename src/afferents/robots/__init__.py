"""Formats of robots and of others; only the command line names it."""
