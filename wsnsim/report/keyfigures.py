"""The figures of summary.json with a label, a fitting unit and a meaning."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from wsnsim.metrics.figures import DROPPED
from wsnsim.report.glossary import ATTEMPTS, FAILURES, OUTCOMES, explained
from wsnsim.report.wording import count, duration, length, number, percent, quantity, with_unit


@dataclass(frozen=True)
class KeyFigure:
    """How one figure is shown."""

    key: str
    label: str
    meaning: str
    show: Callable[[float | int | None], str]
    main: bool = False
    """Whether it stands in the short table at the top."""
    optional: bool = False
    """Whether nothing is said of it where it has no value: not every system makes such estimates."""


def _of(unit: str) -> Callable[[float | int | None], str]:
    return lambda value: quantity(value, unit)


KEY_FIGURES: tuple[KeyFigure, ...] = (
    KeyFigure(
        "position_error_mean_m",
        "Mean position error",
        "distance from the true position, over all steps with an estimate, predictions included",
        length,
        True,
    ),
    KeyFigure(
        "position_error_median_m",
        "Median position error",
        "half of the estimates are closer than this",
        length,
    ),
    KeyFigure(
        "position_rmse_m",
        "RMS position error",
        "root of the mean squared distance; large errors count more",
        length,
        True,
    ),
    KeyFigure(
        "reprojection_error_mean_px",
        "Mean error in the images",
        "distance between true and estimated position as the cameras that see it would show it",
        lambda v: with_unit(v, "px"),
        True,
    ),
    KeyFigure(
        "orientation_error_mean_deg",
        "Mean orientation error",
        "angle of the turn between true and estimated orientation, over all steps with an estimate",
        lambda v: with_unit(v, "°"),
        optional=True,
    ),
    KeyFigure(
        "smoothed_error_mean_m",
        "Mean error, smoothed",
        "distance from the true position of what a smoother made of older instants",
        length,
        optional=True,
    ),
    KeyFigure(
        "lost_fraction",
        "Targets lost",
        "targets whose last estimate is too far off to speak of tracking, or that were never measured",
        percent,
        True,
    ),
    KeyFigure(
        "unmeasured_steps",
        "Estimates without a measurement",
        "target and step pairs whose estimate is a mere prediction, or that have none",
        count,
        True,
    ),
    KeyFigure(
        "heard_ratio",
        "Answers heard",
        "of the answers that cameras were asked for, those that were heard in time",
        percent,
        True,
    ),
    KeyFigure(
        "missed_deadlines",
        "Missed deadlines",
        "those of them for which cameras were asked and none was heard in time, or that have no estimate",
        count,
    ),
    KeyFigure(
        "skipped_steps",
        "Estimates passed over",
        "those of them that were not measured because the tracker was still busy with an earlier step",
        count,
    ),
    KeyFigure(
        "offered_bps",
        "Offered load",
        "application data handed to the network, over the time in which images are taken; what relays pass "
        "on as messages of their own is counted at every hop",
        _of("bit/s"),
        True,
    ),
    KeyFigure(
        "channel_bps",
        "Channel",
        "what the radio channel carries at the very most, shared by all",
        _of("bit/s"),
    ),
    KeyFigure(
        "delivery_ratio",
        "Messages to the base station delivered",
        "of the messages on the way to the base station, those that arrived before the end, by themselves "
        "or in another message",
        percent,
        True,
    ),
    KeyFigure(
        "delivery_ratio_down",
        "Messages to motes delivered",
        "of all other messages, counted once for each receiver, those that arrived before the end",
        percent,
    ),
    KeyFigure(
        "bandwidth_mean_bps",
        "Mean bandwidth used",
        "all frames sent by all nodes: headers, relaying, repeats and acknowledgements included",
        _of("bit/s"),
        True,
    ),
    KeyFigure(
        "bandwidth_peak_bps",
        "Peak bandwidth used",
        "the same, measured between the two sampling instants with the most of it",
        _of("bit/s"),
    ),
    KeyFigure(
        "app_bytes_per_step",
        "Application data a step",
        "bytes that programs handed to the network, counted as in the offered load",
        _of("B"),
    ),
    KeyFigure("mac_bytes_per_step", "Data on the air a step", "bytes of all frames sent", _of("B")),
    KeyFigure(
        "base_ingress_bytes_per_step",
        "Data at the base station a step",
        "application bytes that arrived there",
        _of("B"),
    ),
    KeyFigure(
        "latency_p50_s",
        "Median latency",
        "from the sampling instant to the estimate, where it rests on a measurement",
        duration,
        True,
    ),
    KeyFigure(
        "latency_p95_s", "95th percentile of the latency", "one such estimate in twenty took longer", duration
    ),
    KeyFigure(
        "latency_p99_s",
        "99th percentile of the latency",
        "one such estimate in a hundred took longer",
        duration,
    ),
    KeyFigure(
        "throughput_bps",
        "Throughput",
        "application data that arrived at the base station, over the time in which messages are made",
        _of("bit/s"),
    ),
    KeyFigure("generated", "Messages made", "counted once for each receiver", count),
    KeyFigure("delivered", "Messages delivered", "those of them that arrived by themselves", count),
    KeyFigure("fused", "Messages fused", "those of them that went on in another message", count),
    KeyFigure(
        "in_flight", "Messages on their way", "those of them still queued or on the air at the end", count
    ),
    *(
        KeyFigure(
            outcome,
            f"Messages dropped: {outcome.removeprefix('dropped_').replace('_', ' ')}",
            explained(OUTCOMES, outcome).removeprefix("lost: "),
            count,
        )
        for outcome in DROPPED
    ),
    KeyFigure("mac_frames_tx", "Frames on the air", "data, repeats and acknowledgements of all nodes", count),
    KeyFigure("mac_frames_retried", "Frames repeated", "those of them that repeat one", count),
    KeyFigure("mac_attempts_per_frame", "Attempts a frame", ATTEMPTS, number),
    KeyFigure("attempt_failure_ratio", "Attempts that failed", FAILURES, percent),
    KeyFigure(
        "cca_busy_ratio", "Channel found busy", "share of the looks at the channel before sending", percent
    ),
    KeyFigure(
        "control_share", "Share of the routing protocol", "of the bytes of all frames on the air", percent
    ),
    KeyFigure(
        "budget_waited_s", "Waited for budgets", "frames of all nodes, for their bandwidth budgets", duration
    ),
    KeyFigure(
        "latency_mean_s",
        "Mean latency",
        "from the sampling instant to the estimate, where it rests on a measurement",
        duration,
    ),
    KeyFigure("latency_max_s", "Longest latency", "of all such estimates", duration),
    KeyFigure(
        "energy_per_step_j",
        "Energy a step",
        "drawn by all motes; the base station is not counted",
        _of("J"),
        True,
    ),
    KeyFigure("energy_total_j", "Energy of the run", "drawn by all motes", _of("J")),
    KeyFigure(
        "energy_max_node_j", "Energy of the busiest mote", "the most that one mote drew", _of("J"), True
    ),
    KeyFigure(
        "cpu_cycles_per_step",
        "Processor cycles a step",
        "of all motes together",
        lambda v: "–" if v is None else number(v / 1e6) + " million",
    ),
    KeyFigure(
        "frame_work_max_s",
        "Processor time an image",
        "on the mote where it is longest; what is longer than a frame period cannot be done for every frame",
        duration,
        True,
    ),
    KeyFigure(
        "work_longest_s",
        "Longest piece of work",
        "on one image, message or timer, on the mote where it takes longest",
        duration,
    ),
    KeyFigure(
        "busy_share_max",
        "Busiest processor",
        "share of its mote's life in which it worked",
        percent,
    ),
    KeyFigure(
        "images_skipped",
        "Images skipped",
        "because a mote's processor or imager was still busy",
        count,
        True,
    ),
    KeyFigure("lifetime_first_death_s", "First battery empty", "within this run", duration),
    KeyFigure(
        "lifetime_first_death_extrapolated_s",
        "First battery empty, extrapolated",
        "if every mote went on drawing its average power of this run",
        duration,
        True,
    ),
    KeyFigure("steps", "Tracking steps", "sampling instants after the first", count),
    KeyFigure("simulated_s", "Simulated time", "from the beginning to the end of the run", duration),
    KeyFigure("wall_s", "Time to compute", "on the computer that ran the simulation", duration),
)


def key_rows(summary: Mapping[str, float | int | None], main: bool) -> list[tuple[str, str, str, str]]:
    """Return (label, value, meaning, key) of the figures in the short table, or of the others."""
    died = summary.get("lifetime_first_death_s") is not None
    return [
        (figure.label, figure.show(summary[figure.key]), figure.meaning, figure.key)
        for figure in _of_packets(_after_a_death() if died else KEY_FIGURES, tracking="steps" in summary)
        if figure.main == main and figure.key in summary
        if not figure.optional or summary[figure.key] is not None
    ]


def _of_packets(figures: Sequence[KeyFigure], tracking: bool) -> list[KeyFigure]:
    """Return the figures in the words of a run without cameras, unless it is one with them."""
    if tracking:
        return list(figures)
    return [
        replace(figure, meaning=_PACKETS[figure.key], main=True) if figure.key in _PACKETS else figure
        for figure in figures
    ]


_PACKETS = {
    "latency_mean_s": "from the making of a message to its arrival, queues included",
    "latency_p50_s": "half of the messages took no longer",
    "latency_p95_s": "one message in twenty took longer",
    "latency_p99_s": "one message in a hundred took longer",
    "latency_max_s": "no message took longer",
    "offered_bps": "application data handed to the network, over the time in which messages are made",
    "throughput_bps": "application data that arrived at the base station, over the same time",
    "mac_frames_tx": "data, repeats and acknowledgements of all nodes",
    "mac_attempts_per_frame": ATTEMPTS,
    "attempt_failure_ratio": FAILURES,
    "cca_busy_ratio": "share of the looks at the channel before sending",
}
"""What figures mean in a run without cameras, those of its short table among them."""


def _after_a_death() -> list[KeyFigure]:
    """Return the figures for a run in which a battery emptied, so that nothing need be extrapolated."""
    figures = {figure.key: figure for figure in KEY_FIGURES}
    del figures["lifetime_first_death_extrapolated_s"]
    first, drawn = figures["lifetime_first_death_s"], figures["energy_per_step_j"]
    over = "; an average over the whole run, the time after motes had stopped included"
    figures |= {
        first.key: replace(first, meaning="when the first mote stopped", main=True),
        drawn.key: replace(drawn, meaning=drawn.meaning + over),
    }
    return list(figures.values())
