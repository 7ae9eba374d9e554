"""fem-run: `stage.py` is the way of its data, from scene to artifact."""
