"""What every other room reads and none computes: parameters of laws, and knobs of accuracy."""
