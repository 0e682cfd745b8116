"""Results on disk: the run folder, its SQLite file, and reading both again."""
