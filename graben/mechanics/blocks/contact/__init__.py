"""Where blocks touch: the law of joints, search of candidates, which of them sleep, and forces."""
