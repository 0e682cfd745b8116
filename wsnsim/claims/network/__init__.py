"""The radio network beside theory, an exact Monte Carlo and ns-3: `reports/network.md`."""
