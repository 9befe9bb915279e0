"""From responses to samples: spatial, spatio-temporal and spectral encodings."""
