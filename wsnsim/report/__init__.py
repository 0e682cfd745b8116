"""The report of a run: one offline page with figures to look at and words around them."""
