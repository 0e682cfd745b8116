"""Saturated senders round a sink, in the three ways that frames and assessments are modelled."""

from typing import Final

from wsnsim.claims.network.rows import FIXED_POINT, MONTE_CARLO, NS3, Allowed
from wsnsim.claims.network.runs import Case
from wsnsim.claims.network.section import Section, Study, Tolerances, section_of

TITLE = "Saturated senders round a sink"
WORDS = """
`star_n5`: five senders on a circle of 10 m, each with always a packet of 100 B to send. `whole_window` is the
standard's clear channel assessment, busy if there was power at any time of the 8 symbols; `end_of_window` is
ns-3's. Destructive: whatever overlaps is lost; SINR: the receiver stays with the frame that it locked on
first, and its bits fail as the standard's formula says. The oracle is an exact Monte Carlo of the protocol;
the closed-form fixed point, which takes senders for independent, stands beside it for information.
"""
SENDERS = (2, 5, 10, 20)
DURATION_S: Final = 40.0
SEEDS = 5

STANDARD: Tolerances = {
    ("throughput_kbps", MONTE_CARLO): Allowed(0.02, relative=True),
    ("cca_busy", MONTE_CARLO): Allowed(0.01),
    ("attempt_fails", MONTE_CARLO): Allowed(0.015),
    ("acknowledged", MONTE_CARLO): None,
    ("throughput_kbps", FIXED_POINT): None,
}
END_OF_WINDOW: Tolerances = {
    ("throughput_kbps", NS3): Allowed(0.03, relative=True),
    ("throughput_kbps", MONTE_CARLO): Allowed(0.03, relative=True),
    ("cca_busy", NS3): None,
    ("attempt_fails", NS3): None,
}
SINR: Tolerances = {
    ("throughput_kbps", NS3): Allowed(0.04, relative=True),
    ("acknowledged", NS3): None,
    ("cca_busy", NS3): None,
    ("attempt_fails", NS3): None,
}


def studies() -> list[Study]:
    """Return what is run."""
    found = []
    for n in SENDERS:
        layout = f"star_n{n}"
        standard = Case(layout, None, DURATION_S, "destructive", "whole_window")
        found.append(Study(standard, SEEDS, STANDARD))
        found.append(Study(Case(layout, None, DURATION_S, "destructive"), SEEDS, END_OF_WINDOW))
        found.append(Study(Case(layout, None, DURATION_S), SEEDS, SINR))
    return found


def section() -> Section:
    """Return the section."""
    return section_of(TITLE, WORDS, studies())
