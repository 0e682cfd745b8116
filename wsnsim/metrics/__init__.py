"""Figures of a run: accuracy, traffic, energy and latency, pure functions of its records."""
