"""Artificial SA-I, RA-I and RA-II/vibrotactile afferents for tactile sensing of texture."""

__version__ = "0.1.0"
