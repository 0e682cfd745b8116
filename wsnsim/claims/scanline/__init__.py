"""`reports/scanline.md`: Ercan, El Gamal & Guibas 2007, claim by claim."""
