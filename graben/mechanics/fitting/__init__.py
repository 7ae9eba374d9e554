"""Curves, the objective of a fit, what the curves can tell, and whether starts agree."""
