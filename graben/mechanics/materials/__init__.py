"""Constitutive laws: one compiled function each, a registry, and the driver of a single point."""
