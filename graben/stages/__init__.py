"""One module per command: open inputs, check them, call mechanics, write one artifact."""
