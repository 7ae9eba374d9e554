"""Geometry in the plane: polygons, rings, the local frame of a body far from zero."""
