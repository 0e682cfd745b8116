"""Estimation: Kalman filters, statistics of weighted particles, and Gaussian mixtures."""
