"""The wireless network: frames, medium, MAC, links, routing, collection and dissemination.

It carries bytes and never looks inside them.
"""
