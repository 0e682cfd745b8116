"""What radios draw, and sleep, against what can be computed by hand.

References
----------
Texas Instruments, CC2420 data sheet SWRS041: currents at 3.0 V.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from wsnsim.claims.network.layouts import star
from wsnsim.claims.network.rows import THEORY, Allowed, Estimate, Row
from wsnsim.claims.network.runs import bed
from wsnsim.claims.network.section import Section
from wsnsim.hardware.ledger import EnergyLedger, StateTimes
from wsnsim.hardware.profiles import RADIOS
from wsnsim.net.mac.lpl_config import LplConfig, quiet_ns, step_ns
from wsnsim.net.mac.lpl_family import LplFamily
from wsnsim.net.phy.ieee802154 import air_time_ns
from wsnsim.types import Nanoseconds, Seconds

TITLE = "Energy and sleep"
WORDS = """
A CC2420 at 3.0 V: 17.4 mA to send at 0 dBm, 18.8 mA to receive and to listen. 100 B of payload are 3.744 ms
on the air. `unaccounted_ns`: what the times in all states lack to the simulated time. Low-power listening: a
node looks for 5.5 ms in each interval T after 0.86 ms of start-up; a sender repeats its frame until one copy
meets a look, so that a hop takes start-up, mean backoff, quiet time, turnaround and the frame, and with
probability (T − C)/T half of T − C and half of the time from copy to copy more. Messages leave at phases
spread evenly over the interval.
"""
BATTERY_J = 18_720.0
"""Two AA cells, as Castalia has them."""
FRAMES, FRAME_S = 200, 0.05
INTERVALS_S, MESSAGES = (0.05, 0.1, 0.5), 400
MPDU_BYTES = 111
START_UP_S, CHECK_S, TURNAROUND_S, MEAN_BACKOFF_S = 0.86e-3, 5.5e-3, 0.192e-3, 7.5 * 0.32e-3
AIR_S = 3.744e-3
SEND_W, HEAR_W = 3.0 * 17.4e-3, 3.0 * 18.8e-3


class _Account:
    """Prices the states of a CC2420."""

    def __init__(self) -> None:
        self.ledger = EnergyLedger(BATTERY_J)
        self.times: StateTimes | None = None

    def attend(self, times: StateTimes) -> None:
        """Begin (`wsnsim.net.phy.base.RadioMeter`)."""
        chip = RADIOS["cc2420"]
        powers_w = {
            "sleep": chip.sleep_w,
            "start": chip.start_w,
            "listen": chip.listen_w,
            "receive": chip.receive_w,
            "transmit": chip.transmit_w(0.0),
        }
        self.times = times
        self.ledger.meter(0, "radio", times, powers_w)

    def spent(self, now_ns: Nanoseconds) -> Mapping[str, Nanoseconds]:
        """Return the time in each state [ns]."""
        return {} if self.times is None else self.times.spent_ns(now_ns)


def one_hop() -> dict[str, float]:
    """Send frames that do not meet; return what they cost [µJ] and how long a battery lasts that listens."""
    accounts = {"n0": _Account(), "n1": _Account()}
    network = bed(star(1), 0, meters=accounts)
    for k in range(FRAMES):
        network.at(round(k * FRAME_S * 1e9), partial(network.send, "n1", "n0", bytes(100)))
    network.run(FRAMES * FRAME_S)
    now = network.now_ns
    sender, sink = (accounts[node].ledger.drawn_j(now) for node in ("n1", "n0"))
    unaccounted = sum(abs(now - sum(account.spent(now).values())) for account in accounts.values())
    return {
        "send_uj": 1e6 * sender["radio", "transmit"] / FRAMES,
        "hear_uj": 1e6 * sink["radio", "receive"] / FRAMES,
        "unaccounted_ns": float(unaccounted),
    }


def listening() -> float:
    """Return for how long a radio that only listens lasts on two AA cells [days]."""
    account = _Account()
    network = bed(star(1), 0, meters={"n1": account})
    network.run(100.0)
    return BATTERY_J / (account.ledger.total_drawn_j(network.now_ns) / 100.0) / 86_400.0


def low_power_listening(interval_s: Seconds) -> dict[str, float]:
    """Return a hop's mean latency [ms] and the share of the time that an idle node is awake."""
    family = LplFamily(LplConfig(wake_interval_s=interval_s))
    network = bed(star(1), 0, family=family)
    for k in range(MESSAGES):
        leave_s = 5 * interval_s * k + interval_s * k / MESSAGES
        network.at(round(leave_s * 1e9), partial(network.send, "n1", "n0", bytes(100)))
    network.run(5 * interval_s * (MESSAGES + 1))
    tally = network.tally()
    idle = _Account()
    quiet = bed(star(1), 0, family=family, meters={"n1": idle})
    quiet.run(interval_s)
    before = dict(idle.spent(quiet.now_ns))
    quiet.run(101 * interval_s)
    after = idle.spent(quiet.now_ns)
    asleep_ns = after["sleep"] - before["sleep"]
    return {
        "latency_mean_ms": 1e3 * float(tally.delays_s.mean()),
        "duty_cycle": 1.0 - asleep_ns / (100e9 * interval_s),
        "lost": float(tally.generated - tally.delivered),
    }


def latency_ms(interval_s: Seconds) -> float:
    """Return the closed form of a hop's mean latency under low-power listening [ms]."""
    setup_s = START_UP_S + MEAN_BACKOFF_S + 1e-9 * quiet_ns() + TURNAROUND_S
    asleep_s = interval_s - CHECK_S
    missed_s = asleep_s / interval_s * (asleep_s + 1e-9 * step_ns(MPDU_BYTES)) / 2.0
    return 1e3 * (setup_s + 1e-9 * air_time_ns(MPDU_BYTES) + missed_s)


def _rows(results: Sequence[Any]) -> list[Row]:
    hop, days, *lpl = results
    closed, exact = Allowed(1e-3, relative=True), Allowed(0.0)
    known = [
        ("one hop 100 B", "send_uj", hop["send_uj"], 1e6 * SEND_W * AIR_S, closed),
        ("one hop 100 B", "hear_uj", hop["hear_uj"], 1e6 * HEAR_W * AIR_S, closed),
        ("one hop 100 B", "unaccounted_ns", hop["unaccounted_ns"], 0.0, exact),
        ("listening, 18 720 J", "lifetime_days", days, BATTERY_J / HEAR_W / 86_400.0, closed),
    ]
    for interval_s, got in zip(INTERVALS_S, lpl, strict=True):
        case, within = f"low-power listening, T = {interval_s:g} s", Allowed(0.05, relative=True)
        known.append((case, "latency_mean_ms", got["latency_mean_ms"], latency_ms(interval_s), within))
        duty = (START_UP_S + CHECK_S) / interval_s
        known.append((case, "duty_cycle", got["duty_cycle"], duty, within))
        known.append((case, "lost", got["lost"], 0.0, exact))
    return [
        Row(TITLE, case, figure, Estimate(ours), THEORY, Estimate(value), allowed)
        for case, figure, ours, value, allowed in known
    ]


def section() -> Section:
    """Return the section."""
    sleepers = [partial(low_power_listening, interval_s) for interval_s in INTERVALS_S]
    return Section(TITLE, WORDS, (partial(one_hop), partial(listening), *sleepers), _rows)
