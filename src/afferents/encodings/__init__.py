"""From responses to samples: the paper's encodings, then orders and wavenumbers."""
