"""From responses to samples: the paper's encodings, then orders, wavenumbers and kernels."""
