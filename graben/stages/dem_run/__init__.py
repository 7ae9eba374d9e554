"""dem-run: `stage.py` hands a scene to the stage of its kind, blocks or particles."""
