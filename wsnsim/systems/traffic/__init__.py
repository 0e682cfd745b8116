"""Packets without a purpose: what studies of convergecast, saturation and latency send over a network."""
