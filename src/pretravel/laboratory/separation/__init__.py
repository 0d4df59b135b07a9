"""Machine and probe separated by indexing."""
