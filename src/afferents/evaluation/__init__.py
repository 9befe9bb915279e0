"""Leave one speed out: folds, leakage, metrics and results on disk."""
