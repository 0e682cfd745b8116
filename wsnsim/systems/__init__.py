"""Tracking systems, sans-I/O: programs for motes, relays and base stations.

`base` holds the protocols; each published system has a room of its own and
knows neither the network nor the other systems.
"""
