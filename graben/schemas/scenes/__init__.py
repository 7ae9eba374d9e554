"""Scene models, one file per kind."""
