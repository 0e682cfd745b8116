"""Ground truth: what the targets are and how they move. Nothing here knows of cameras or trackers."""
