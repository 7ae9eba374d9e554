"""What all stages use: records, estimates of size, error measures, workers, the last good state."""
