"""Estimation: Kalman filters and statistics of weighted particles."""
