"""Codecs and payloads: what trackers say to each other, in bytes."""
