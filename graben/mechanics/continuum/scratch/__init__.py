"""Scratch test: 3D hexahedra, explicit in time, current configuration, contact with a rigid sphere."""
