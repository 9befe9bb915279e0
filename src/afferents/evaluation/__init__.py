"""Leave one group out, by default a speed: trainings, results on disk, accuracies."""
