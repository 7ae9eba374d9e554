"""Search for parameters: swarm, Levenberg-Marquardt, and what the data can and cannot tell."""
