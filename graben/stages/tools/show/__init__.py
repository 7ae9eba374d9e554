"""Pictures of artifacts, one file per kind: `draw(dataset, figure)`."""
