"""Analyses of spikes, artificial and natural; only the command line names it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
