"""What a file must hold: scene models, artifact layouts, units, provenance, checks."""
