"""Cited power and speed tables, the price of work, batteries and the energy ledger."""
