"""Trackers P and T0 to T4 beside what Kushwaha & Koutsoukos (2013) report of them: `reports/multiview.md`."""
