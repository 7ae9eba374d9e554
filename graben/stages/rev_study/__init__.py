"""rev-study: `stage.py` is the way of its data, from runs to a representative size."""
