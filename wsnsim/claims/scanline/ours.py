"""What the paper leaves open and the studies answer, and the numbers that decide it."""

from wsnsim.claims.rules import Band, Claim
from wsnsim.claims.scanline.evidence import JOULES
from wsnsim.claims.scanline.measures import error, over_twin, ratio
from wsnsim.claims.scanline.parts import BOTH, LESS, LITTLE, SLACK, ScanlineClaim, part, units
from wsnsim.claims.scanline.settings import behind_block, hulled, known, on_air, open_room
from wsnsim.claims.scanline.studies import HULL_CROWDS, NONE, PERFECT

_EIGHT = ((open_room, "no block", 1.6, 1.1), (behind_block, "block", 1.9, 1.3))
"""Most that eight cameras may err by without priors and with perfect ones [unit]."""

OURS: tuple[ScanlineClaim, ...] = (
    Claim(
        "eight",
        "Ours: eight cameras err by two units at most, with or without a block, whatever they know.",
        "ours, to Figs. 9, 11",
        tuple(
            part(f"{room}, {prior}: {BOTH}", Band(high=most), error(where(8, prior)), units)
            for where, room, *limits in _EIGHT
            for prior, most in zip((NONE, PERFECT), limits, strict=True)
        ),
    ),
    Claim(
        "cheap-priors",
        "Ours: there are cheap ones. Whole scan lines that must be consistent, and the room alone, both "
        "lower the error of four cameras.",
        "ours, to Sec. 7",
        (
            part("scan lines: error over none", LESS, ratio(known("scan_lines"), known(NONE))),
            part(f"scan lines: {BOTH}", Band(high=4.0), error(known("scan_lines")), units),
            part("the room alone: error over none", LESS, ratio(known("stationary"), known(NONE))),
        ),
    ),
    Claim(
        "hull",
        "Ours: as priors, pieces of the visual hull do not notably lower the error of eight cameras, among "
        "ten occluders or forty.",
        "ours, to Sec. 4.4",
        tuple(
            part(
                f"M = {m}: error with {shape} over none",
                Band(low=1 / LITTLE),
                ratio(hulled(m, shape), hulled(m, "none")),
            )
            for m in HULL_CROWDS
            for shape in ("ellipses", "polygons")
        ),
    ),
    Claim(
        "joules",
        "Ours: in joules priors hardly count, as processing a frame costs far more than what is said of it.",
        "ours",
        tuple(
            part(
                f"all energy of the motes, {cell} over bearings",
                Band(high=SLACK),
                ratio(on_air(cell), on_air("bearing"), JOULES),
            )
            for cell in ("kalman", "scan_line")
        ),
    ),
    Claim(
        "speed",
        "Ours: a step with Gaussian priors is at least fifty times as fast as the same in plain Python.",
        "ours, to Fig. 13",
        tuple(part(f"N = {n}: plain Python over it", Band(low=50.0), over_twin(n)) for n in (4, 8)),
    ),
)
