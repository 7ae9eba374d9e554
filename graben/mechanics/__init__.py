"""The physics: arrays and small dataclasses in and out; knows no file, no scene, no command."""
