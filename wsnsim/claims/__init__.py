"""What the papers claim, beside what finished sweeps show: pages under `reports/`, made by command.

Everything here is a pure function of the folders of sweeps: the same results give the same bytes.
"""
