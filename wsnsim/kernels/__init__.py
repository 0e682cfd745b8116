"""Compiled loops over arrays and numbers: no objects, no files, no randomness."""
