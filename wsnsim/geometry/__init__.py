"""Rotations, pinhole cameras and the outlines of ellipsoids; arrays in, arrays out, no randomness."""
