"""One file per command: options, help, progress, exit code. No physics, no file format."""
