"""What is done to a model: stress put in, walls that move, loads that change, blocks taken out."""
