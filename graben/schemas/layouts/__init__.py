"""Artifact layouts, one file per kind."""
