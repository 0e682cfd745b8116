"""A node's power: what its components draw by state, and the instant its battery is empty."""

from collections.abc import Callable

from wsnsim.hardware.ledger import EnergyLedger, StateTimes
from wsnsim.hardware.profiles import Imager, Platform, Radio
from wsnsim.net.clock import Clock
from wsnsim.units import NS_PER_S


class NodePower:
    """Tells the ledger of every change of state of a node's components.

    Parameters
    ----------
    capacity_j : of the battery [J]; None on mains
    tx_power_dbm : the radio's setting, which decides what sending draws; the radio draws nothing before
        the network switches it on
    imager : None for a node without a camera
    """

    def __init__(
        self,
        clock: Clock,
        capacity_j: float | None,
        platform: Platform,
        radio: Radio,
        tx_power_dbm: float,
        imager: Imager | None,
    ) -> None:
        self._clock = clock
        self._platform = platform
        self._imager = imager
        self._radio_w = {
            "sleep": radio.sleep_w,
            "listen": radio.listen_w,
            "receive": radio.receive_w,
            "transmit": radio.transmit_w(tx_power_dbm),
            "start": radio.start_w,
        }
        self.ledger = EnergyLedger(capacity_j)
        self.ledger.enter(0, "board", "base load", platform.board_w)
        self.cpu(busy=False)
        if imager is not None:
            self.camera(active=False)
        self._most_w = (
            platform.board_w
            + max(platform.cpu_active_w, platform.cpu_idle_w)
            + max(self._radio_w.values())
            + (0.0 if imager is None else max(imager.active_w(), imager.idle_w()))
        )

    def cpu(self, busy: bool) -> None:
        """Let the processor work, or wait."""
        power = self._platform.cpu_active_w if busy else self._platform.cpu_idle_w
        self._enter("cpu", "work" if busy else "idle", power)

    def camera(self, active: bool) -> None:
        """Let the imager expose and read out, or idle."""
        assert self._imager is not None
        power = self._imager.active_w() if active else self._imager.idle_w()
        self._enter("camera", "capture" if active else "idle", power)

    def attend(self, times: StateTimes) -> None:
        """Ask the radio for the times of its states from now on."""
        self.ledger.meter(self._clock.now, "radio", times, self._radio_w)

    def left_j(self) -> float:
        """Return the energy left in the battery now [J]; infinite on mains."""
        return self.ledger.left_j(self._clock.now)

    def watch(self, on_empty: Callable[[], None]) -> None:
        """Call `on_empty` once, at the instant the battery is empty.

        Between two looks the battery cannot become empty, whatever the
        components do: the next look is when it would be if all of them drew
        their most. The looks close in on the instant, to the nanosecond.
        """
        if self.ledger.capacity_j is None:
            return
        left_j = self.left_j()
        if left_j <= 0.0:
            on_empty()
            return
        wait = max(1, int(left_j / self._most_w * NS_PER_S))
        self._clock.call(wait, lambda: self.watch(on_empty))

    def _enter(self, component: str, cause: str, power_w: float) -> None:
        self.ledger.enter(self._clock.now, component, cause, power_w)
