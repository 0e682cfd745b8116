"""Links from files: gains of TOSSIM topologies, tables of reception ratios, and k7 connectivity traces.

All three name motes by labels of their own; which node a label is says the scenario
(`nodes`), or else the label is the node's name or its place among the nodes. Where the scenario
says it, a file may hold more motes than the run has.

References
----------
Levis, Lee, TOSSIM: A simulator for TinyOS networks (TinyOS 2 tutorial), for topologies: lines `gain FROM TO
DB` and `noise NODE FLOOR SD`; Municio et al., Simulating 6TiSCH networks (Trans. Emerging Tel. Tech.
30(3), 2019), for k7: a line of JSON, then rows of datetime, src, dst, channel, mean_rssi, pdr, tx_count.
"""

import gzip
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import accumulate
from math import isnan, nan
from pathlib import Path

import numpy as np

from wsnsim.errors import Problem
from wsnsim.net.channel.noise import HISTORY
from wsnsim.scenario.faults import did_you_mean, shown
from wsnsim.scenario.schema_propagation import Labels
from wsnsim.types import FloatArray, IntArray, NodeId
from wsnsim.world.track_text import Row, content_rows, fail

_K7_COLUMNS = ("datetime", "src", "dst", "channel", "mean_rssi", "pdr", "tx_count")
_PRR_COLUMNS = ("from", "to", "prr")


@dataclass(frozen=True, eq=False)
class GainTable:
    """Links and noise of a TOSSIM topology, for the nodes of a run.

    Parameters
    ----------
    senders, receivers : (m,), (m,) - numbers of nodes
    gain_db : (m,) - what arrives over what is sent, negative [dB]
    floors_dbm : (n,) - mean noise of each node, NaN where the file gives none [dBm]
    noise_sd_db : (n,) - its standard deviation [dB]
    """

    senders: IntArray
    receivers: IntArray
    gain_db: FloatArray
    floors_dbm: FloatArray
    noise_sd_db: FloatArray


@dataclass(frozen=True, eq=False)
class RatioTable:
    """Links of which the share of frames that get through is known.

    Parameters
    ----------
    senders, receivers : (m,), (m,) - numbers of nodes
    ratios : (m,) - from 0 to 1 [-]
    """

    senders: IntArray
    receivers: IntArray
    ratios: FloatArray


@dataclass(frozen=True, eq=False)
class LinkRecord:
    """What was measured of one link: (k,) times from the first record of all [s], ratios and RSSI.

    Of a record without RSSI that is NaN.
    """

    times_s: FloatArray
    ratios: FloatArray
    rssi_dbm: FloatArray


def read_gains(file: Path, nodes: Sequence[NodeId], labels: Labels | None) -> GainTable:
    """Read a TOSSIM topology; the same pair twice, a gain over 0 dB and unknown nodes are refused.

    Parameters
    ----------
    file : text, fields separated by blanks
    nodes : names of the run's nodes
    labels : what the file calls each node, or None
    """
    book, problems = _Labels(nodes, labels, file), list[Problem]()
    gains: dict[tuple[int, int], float] = {}
    noise: dict[int, tuple[float, float]] = {}
    lines: dict[tuple[int, ...], int] = {}
    for row in content_rows(file, commas=False):
        kind = row.fields[0].lower()
        if len(row.fields) != 4 or kind not in ("gain", "noise"):
            message = f"must be `gain FROM TO DB` or `noise NODE FLOOR SD`, got {shown(' '.join(row.fields))}"
            problems.append(Problem("", message, file, row.line, row.columns[0]))
            continue
        ends = [book.node(row, at, problems) for at in ((1, 2) if kind == "gain" else (1,))]
        values = [row.number(name, at, file, problems) for name, at in _NUMBERS[kind]]
        if kind == "gain" and values[0] > 0.0:
            problems.append(_wrong(row, 3, f"gain: must be 0 dB or less, got {values[0]:g}", file))
        if kind == "noise" and values[1] < 0.0:
            problems.append(_wrong(row, 3, f"SD: must be 0 dB or more, got {values[1]:g}", file))
        known = _known(ends, row, lines, file, problems)
        if known is None:
            continue
        if kind == "gain":
            gains[known[0], known[1]] = values[0]
        else:
            noise[known[0]] = values[0], values[1]
    _finish(file, book, len(gains), "gain", problems)
    pairs = np.array(list(gains), dtype=np.int64).reshape(-1, 2)
    floors = np.array([noise.get(at, (nan, nan)) for at in range(len(nodes))]).reshape(-1, 2)
    return GainTable(pairs[:, 0], pairs[:, 1], np.array(list(gains.values())), floors[:, 0], floors[:, 1])


_NUMBERS = {"gain": (("gain", 3),), "noise": (("floor", 2), ("SD", 3))}
"""Which fields of a line are numbers."""


def read_ratios(file: Path, nodes: Sequence[NodeId], labels: Labels | None) -> RatioTable:
    """Read a table of reception ratios, a CSV file with the columns from, to and prr.

    Parameters
    ----------
    file, nodes, labels : as for `read_gains`
    """
    book, problems = _Labels(nodes, labels, file), list[Problem]()
    rows = content_rows(file)
    _check_header(next(rows, None), _PRR_COLUMNS, file)
    ratios: dict[tuple[int, int], float] = {}
    lines: dict[tuple[int, ...], int] = {}
    for row in rows:
        ends = [book.node(row, at, problems) for at in (0, 1)]
        ratio = row.number("prr", 2, file, problems)
        if not (isnan(ratio) or 0.0 <= ratio <= 1.0):
            problems.append(_wrong(row, 2, f"prr: must be 0 to 1, got {ratio:g}", file))
        known = _known(ends, row, lines, file, problems)
        if known is not None:
            ratios[known[0], known[1]] = ratio
    _finish(file, book, len(ratios), "link", problems)
    pairs = np.array(list(ratios), dtype=np.int64).reshape(-1, 2)
    return RatioTable(pairs[:, 0], pairs[:, 1], np.array(list(ratios.values())))


def read_k7(
    file: Path, nodes: Sequence[NodeId], labels: Labels | None, channel: int
) -> dict[tuple[int, int], LinkRecord]:
    """Read the records of a k7 trace on one channel.

    A record whose PDR is NaN or missing counts as not made; one whose RSSI is, has none.

    Parameters
    ----------
    file, nodes, labels : as for `read_gains`; the name of a packed file ends in .gz
    channel : of IEEE 802.15.4

    Returns
    -------
    by sender and receiver, in the order of time
    """
    book, problems = _Labels(nodes, labels, file), list[Problem]()
    rows = _k7_rows(file)
    _check_header(next(rows, None), _K7_COLUMNS, file)
    found: dict[tuple[int, int], list[tuple[float, float, float]]] = {}
    channels: set[str] = set()
    for row in rows:
        fields = row.fields
        if len(fields) == len(_K7_COLUMNS) and fields[3] != str(channel):
            channels.add(fields[3])
            continue
        ends = [book.node(row, at, problems) for at in (1, 2)]
        try:
            # without a zone; as if in UTC, so that no clock is put forward or back
            time_s = datetime.fromisoformat(f"{fields[0]}+00:00").timestamp()
        except ValueError:
            problems.append(
                _wrong(row, 0, f"datetime: must be an ISO 8601 time, got {shown(fields[0])}", file)
            )
            continue
        rssi_dbm, ratio = (
            _or_nan(row, name, at, file, problems) for name, at in (("mean_rssi", 4), ("pdr", 5))
        )
        if not (isnan(ratio) or 0.0 <= ratio <= 1.0):
            problems.append(_wrong(row, 5, f"pdr: must be 0 to 1, got {ratio:g}", file))
        known = _known(ends, row, {}, file, problems)
        if known is not None and not isnan(ratio):
            found.setdefault((known[0], known[1]), []).append((time_s, ratio, rssi_dbm))
    if not (found or problems) and channels:
        got = ", ".join(sorted(channels))
        problems.append(Problem("", f"must hold records on channel {channel}, got channels {got}", file))
    _finish(file, book, len(found), "record", problems)
    first_s = min(record[0] for records in found.values() for record in records)
    tracks = {}
    for pair, records in found.items():
        times, ratios, rssi = np.array(sorted(records)).T
        tracks[pair] = LinkRecord(times - first_s, ratios, rssi)
    return tracks


def read_noise(file: Path) -> FloatArray:
    """Read a trace of noise, one number a line [dBm]; the lines follow each other by a millisecond.

    A trace has no gaps: a line that is no number is refused, and a blank one is no line.
    """
    problems: list[Problem] = []
    samples = [row.number("noise", 0, file, problems) for row in content_rows(file)]
    if not problems and len(samples) <= HISTORY:
        message = f"must have more than {HISTORY} samples of noise, got {len(samples)}"
        problems.append(Problem("", message, file))
    if problems:
        fail(problems)
    return np.array(samples)


class _Labels:
    """Which node of a run a file means."""

    def __init__(self, nodes: Sequence[NodeId], labels: Labels | None, file: Path) -> None:
        self._file, self._partial = file, labels is not None
        if labels is None:
            self.known = {str(at): at for at in range(len(nodes))} | {
                name: at for at, name in enumerate(nodes)
            }
        else:
            _check_labels(nodes, labels)
            self.known = {str(labels[name]): at for at, name in enumerate(nodes) if name in labels}
        self.met: set[int] = set()

    def node(self, row: Row, index: int, problems: list[Problem]) -> int | None:
        """Return the number of a field's node, or None, and one more problem if it should have been one."""
        label = row.fields[index] if index < len(row.fields) else ""
        at = self.known.get(label)
        if at is not None:
            self.met.add(at)
        elif not self._partial or not label:
            # a number is like many others, whatever was meant
            near = "" if label.isdecimal() else did_you_mean(label, self.known)
            message = (
                f"must be a node by its name, or by its place from 0, got {shown(label)}{near}; "
                "if the file has more motes than the run, say under "
                "network.propagation.nodes which of them are its nodes"
            )
            problems.append(_wrong(row, index, message, self._file))
        return at

    def unmet(self) -> list[str]:
        """Return the labels that the scenario gives and the file does not have."""
        return [label for label, at in self.known.items() if self._partial and at not in self.met]


def _check_labels(nodes: Sequence[NodeId], labels: Labels) -> None:
    """Make sure that labels are those of nodes, each of another."""
    problems = []
    owners: dict[str, NodeId] = {}
    for name, label in labels.items():
        key = f"network.propagation.nodes.{name}"
        if name not in nodes:
            near = did_you_mean(name, nodes)
            problems.append(Problem(key, f"must be the name of a node, got {shown(name)}{near}"))
        elif (other := owners.setdefault(str(label), name)) != name:
            problems.append(Problem(key, f"must be another mote than that of {shown(other)}, got {label}"))
    if problems:
        fail(problems)


def _known(
    ends: list[int | None], row: Row, lines: dict[tuple[int, ...], int], file: Path, problems: list[Problem]
) -> tuple[int, ...] | None:
    """Return what a line is about where that is nodes of the run and not what a line before it was."""
    nodes = tuple(end for end in ends if end is not None)
    if len(nodes) < len(ends):
        return None
    if len(set(nodes)) < len(nodes):
        problems.append(_wrong(row, 0, "must lead from one node to another, got one to itself", file))
        return None
    if nodes in lines:
        problems.append(_wrong(row, 0, f"must be given once, stands in line {lines[nodes]} too", file))
        return None
    lines[nodes] = row.line
    return nodes


def _or_nan(row: Row, name: str, index: int, file: Path, problems: list[Problem]) -> float:
    """Return a field as a number; NaN where it is missing or says so."""
    if index >= len(row.fields) or row.fields[index].lower() in ("", "nan", "none"):
        return nan
    return row.number(name, index, file, problems)


def _wrong(row: Row, index: int, message: str, file: Path) -> Problem:
    return Problem("", message, file, row.line, row.column(index))


def _check_header(header: Row | None, columns: tuple[str, ...], file: Path) -> None:
    if header is None:
        fail([Problem("", f"must begin with the columns {','.join(columns)}, got nothing more", file)])
    if tuple(name.lower() for name in header.fields) != columns:
        got = shown(",".join(header.fields))
        fail([_wrong(header, 0, f"must be the columns {','.join(columns)}, got {got}", file)])


def _finish(file: Path, book: _Labels, found: int, what: str, problems: list[Problem]) -> None:
    """Raise what is wrong with a whole file."""
    if not problems:
        problems += [
            Problem("", f"must have a mote {shown(label)}, has none", file) for label in book.unmet()
        ]
    if not (problems or found):
        problems.append(Problem("", f"must have a {what} between nodes of the run, got none", file))
    if problems:
        fail(problems)


def _k7_rows(file: Path) -> Iterator[Row]:
    """Yield the rows of a k7 trace after its line of JSON."""
    try:
        with (gzip.open if file.suffix == ".gz" else open)(file, "rt", encoding="utf-8") as text:
            first = text.readline()
            if not isinstance(_json(first), dict):
                message = f"must begin with a line of JSON, got {shown(first.rstrip())}"
                fail([Problem("", message, file, 1, 1)])
            for number, line in enumerate(text, start=2):
                if line.strip():
                    pieces = line.rstrip("\n").split(",")
                    columns = accumulate((len(piece) + 1 for piece in pieces[:-1]), initial=1)
                    fields = tuple(piece.strip() for piece in pieces)
                    yield Row(number, fields, tuple(columns), len(line) + 1)
    except (OSError, EOFError, UnicodeDecodeError) as error:
        fail([Problem("", f"must be a readable k7 trace, got: {error}", file)])


def _json(line: str) -> object:
    try:
        return json.loads(line)
    except json.JSONDecodeError:
        return None
