"""Searches of a unit box: swarms, DDS, evolution, Levenberg-Marquardt. They know nothing of curves."""
