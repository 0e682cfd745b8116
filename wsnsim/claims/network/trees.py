"""Packets that climb the trees of random geometric graphs, as ns-3 has them."""

from wsnsim.claims.network.rows import NS3, Allowed
from wsnsim.claims.network.runs import Case
from wsnsim.claims.network.section import Section, Study, section_of

TITLE = "Trees of 10, 50 and 200 motes"
WORDS = """
100 s of packets of 100 B, the k-th of each mote at a random time of its k-th period T, 5 s to drain; the tree
is the layout's own, links of up to 50 m; SINR and `end_of_window`, as in ns-3. PDR: distinct packets at the
sink over those generated. Frames: data and acknowledgements, all attempts.
"""
DURATION_S = 100.0
SEEDS = 5
PDR = {
    ("rgg_n10", 10.0): 0.01,
    ("rgg_n10", 1.0): 0.01,
    ("rgg_n50", 10.0): 0.01,
    ("rgg_n50", 1.0): 0.02,
    ("rgg_n200", 10.0): 0.02,
    ("rgg_n200", 1.0): 0.03,
}
"""How far the delivery ratio may be from ns-3's, by layout and period [s]."""


def studies() -> list[Study]:
    """Return what is run."""
    return [
        Study(
            Case(layout, period_s, DURATION_S),
            SEEDS,
            {
                ("pdr", NS3): Allowed(pdr),
                ("delay_mean_ms", NS3): Allowed(0.06, relative=True),
                ("delay_p95_ms", NS3): Allowed(0.10, relative=True),
                ("frames", NS3): Allowed(0.05, relative=True),
                ("attempt_fails", NS3): None,
            },
        )
        for (layout, period_s), pdr in PDR.items()
    ]


def section() -> Section:
    """Return the section."""
    return section_of(TITLE, WORDS, studies())
