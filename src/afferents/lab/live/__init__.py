"""Recognising texture as it slides: from running sources to predictions, by exported models."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
