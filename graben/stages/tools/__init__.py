"""The small tools: check, show (pictures) and report."""
