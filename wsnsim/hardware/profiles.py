"""Cited power and speed tables of processors, radios, imagers and batteries.

A profile turns work into cycles, seconds and watts. Clock speeds and powers
come from data sheets and papers named in `source`; cycles per operation are
estimates where no measurement exists, and `source` says so. Left out: caches,
voltage scaling while running, temperature, and the energy of switching
between states.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from wsnsim.hardware.work import Work
from wsnsim.types import Seconds


@dataclass(frozen=True)
class Platform:
    """A processor board: how fast it works, and what it draws meanwhile."""

    name: str
    description: str
    source: str
    clock_hz: float
    cycles_per_int_op: float
    cycles_per_float_op: float
    """Software floating point included, where the processor has no unit for it."""
    cycles_per_byte: float
    """Memory traffic, beyond what the operations themselves cost."""
    cpu_active_w: float
    cpu_idle_w: float
    board_w: float
    """What the rest of the board draws all the time: memory, regulators."""

    def cycles(self, work: Work) -> float:
        """Return the processor cycles that `work` takes."""
        return (
            work.int_ops * self.cycles_per_int_op
            + work.float_ops * self.cycles_per_float_op
            + work.memory_bytes * self.cycles_per_byte
        )

    def seconds(self, work: Work) -> Seconds:
        """Return the time that `work` takes [s]."""
        return self.cycles(work) / self.clock_hz


@dataclass(frozen=True)
class Radio:
    """A transceiver: its electrical power in each state."""

    name: str
    description: str
    source: str
    standard: str
    """Of the networks that it speaks in: `ieee802154` or `ieee80211b`."""
    supply_v: float
    sleep_w: float
    listen_w: float
    receive_w: float
    transmit_table_w: Mapping[float, float]
    """Electrical power [W] by output power [dBm]."""
    crystal_w: float | None = None
    """While the crystal starts [W]; None: as much as listening."""

    @property
    def start_w(self) -> float:
        """Electrical power from being switched on until it can be used [W]."""
        return self.listen_w if self.crystal_w is None else self.crystal_w

    def transmit_w(self, tx_power_dbm: float) -> float:
        """Return the electrical power while sending [W].

        The chip is set to the nearest of its output powers that is not below
        the one asked for.

        Parameters
        ----------
        tx_power_dbm : wanted output power [dBm]

        Raises
        ------
        ValueError : the chip cannot send that loud
        """
        enough = [level for level in self.transmit_table_w if level >= tx_power_dbm]
        if not enough:
            raise ValueError(
                f"{self.name}: tx power must be at most {max(self.transmit_table_w):g} dBm, "
                f"got {tx_power_dbm:g} dBm"
            )
        return self.transmit_table_w[min(enough)]


@dataclass(frozen=True)
class Imager:
    """An image sensor whose power is linear in its pixel clock."""

    name: str
    description: str
    source: str
    active_base_w: float
    active_j_per_tick: float
    idle_base_w: float
    idle_j_per_tick: float
    pixel_clock_hz: float
    """The clock it is run at; one pixel is read out in one tick."""

    def active_w(self, pixel_clock_hz: float | None = None) -> float:
        """Return the power while an image is read out [W], at the given or the profile's clock [Hz]."""
        return self.active_base_w + self.active_j_per_tick * self._clock_hz(pixel_clock_hz)

    def idle_w(self, pixel_clock_hz: float | None = None) -> float:
        """Return the power between images [W], at the given or the profile's clock [Hz]."""
        return self.idle_base_w + self.idle_j_per_tick * self._clock_hz(pixel_clock_hz)

    def capture_seconds(self, resolution_px: tuple[int, int], pixel_clock_hz: float | None = None) -> Seconds:
        """Return the time of one read-out [s] of an image of (width, height) pixels."""
        width, height = resolution_px
        return width * height / self._clock_hz(pixel_clock_hz)

    def _clock_hz(self, pixel_clock_hz: float | None) -> float:
        return self.pixel_clock_hz if pixel_clock_hz is None else pixel_clock_hz


@dataclass(frozen=True)
class Battery:
    """A store of energy; `capacity_j` is None on mains."""

    name: str
    description: str
    source: str
    capacity_j: float | None


_PLATFORMS = (
    Platform(
        name="telosb",
        description="TelosB mote, MSP430F1611 at 4 MHz, no floating-point unit",
        source=(
            "Polastre, Szewczyk, Culler, Telos (IPSN 2005) and Moteiv's Tmote Sky data sheet: module at 3 V "
            "1.8 mA active, 54.5 uA idle, 5.1 uA standby; cycles per operation are estimates (16-bit "
            "instructions of 1-6 cycles; a single-precision software add or multiply about 200)"
        ),
        clock_hz=4e6,
        cycles_per_int_op=4.0,
        cycles_per_float_op=200.0,
        cycles_per_byte=3.0,
        cpu_active_w=(1.8e-3 - 5.1e-6) * 3.0,
        cpu_idle_w=(54.5e-6 - 5.1e-6) * 3.0,
        board_w=5.1e-6 * 3.0,
    ),
    Platform(
        name="imote2_104",
        description="Imote2, PXA271 XScale at 104 MHz, no floating-point unit",
        source=(
            "Intel PXA27x EMTS, typical power at 104 MHz: 116 mW active, 64 mW idle; board: estimate from "
            "Crossbow's Imote2 data sheet (66 mA at 4.5 V, 104 MHz, radio on) less processor and radio; "
            "cycles per operation are estimates (a single-precision software add or multiply about 40)"
        ),
        clock_hz=104e6,
        cycles_per_int_op=1.3,
        cycles_per_float_op=40.0,
        cycles_per_byte=1.0,
        cpu_active_w=0.116,
        cpu_idle_w=0.064,
        board_w=66e-3 * 4.5 - 0.116 - 18.8e-3 * 3.0,
    ),
    Platform(
        name="imote2_416",
        description="Imote2, PXA271 XScale at 416 MHz, no floating-point unit",
        source=(
            "Intel PXA27x EMTS, typical power at 416 MHz: 570 mW active, 186 mW idle; board as imote2_104; "
            "cycles per operation are estimates (a single-precision software add or multiply about 40)"
        ),
        clock_hz=416e6,
        cycles_per_int_op=1.3,
        cycles_per_float_op=40.0,
        cycles_per_byte=2.0,
        cpu_active_w=0.570,
        cpu_idle_w=0.186,
        board_w=66e-3 * 4.5 - 0.116 - 18.8e-3 * 3.0,
    ),
    Platform(
        name="stm32l476",
        description="STM32L476 microcontroller, Cortex-M4F at 80 MHz, hardware single-precision floats",
        source=(
            "STMicroelectronics DS10198 (features): 100 uA/MHz running at 80 MHz from the linear regulator, "
            "37 uA/MHz asleep, both quoted from memory, at 3.0 V; board 10 mW (image memory, regulator) and "
            "cycles per operation are estimates (Cortex-M4 TRM: float add and multiply 1 cycle, load 2); "
            "whether an image fits its 128 kB of RAM is not modelled"
        ),
        clock_hz=80e6,
        cycles_per_int_op=1.3,
        cycles_per_float_op=3.0,
        cycles_per_byte=1.0,
        cpu_active_w=100e-6 * 80.0 * 3.0,
        cpu_idle_w=37e-6 * 80.0 * 3.0,
        board_w=0.010,
    ),
    Platform(
        name="cortex_a9_1200",
        description="ARM Cortex-A9 board, one core at 1.2 GHz, hardware floats",
        source=(
            "processor: 675 mW active at 1.2 GHz, 25 mW idle, as quoted for mobile-vision phones of 2013; "
            "board 100 mW and cycles per operation (dual issue, VFPv3) are estimates"
        ),
        clock_hz=1.2e9,
        cycles_per_int_op=0.7,
        cycles_per_float_op=1.5,
        cycles_per_byte=0.25,
        cpu_active_w=0.675,
        cpu_idle_w=0.025,
        board_w=0.100,
    ),
    Platform(
        name="rpi_zero2w",
        description="Raspberry Pi Zero 2 W, one Cortex-A53 core at 1 GHz, hardware floats",
        source=(
            "published board measurements at 5 V: 120 mA idle, about 390 mA busy, counted as 0.6 W board and "
            "1.35 W processor (the busy figure loads more than one core, so it is an upper estimate); cycles "
            "per operation are estimates"
        ),
        clock_hz=1.0e9,
        cycles_per_int_op=0.8,
        cycles_per_float_op=1.5,
        cycles_per_byte=0.25,
        cpu_active_w=(0.390 - 0.120) * 5.0,
        cpu_idle_w=0.0,
        board_w=0.120 * 5.0,
    ),
    Platform(
        name="workstation",
        description="Base station on mains, one core of a desktop processor at 3 GHz",
        source="estimate: 15 W for a busy core, 2 W idle, 30 W for the rest; cycles per operation estimated",
        clock_hz=3.0e9,
        cycles_per_int_op=0.4,
        cycles_per_float_op=0.5,
        cycles_per_byte=0.1,
        cpu_active_w=15.0,
        cpu_idle_w=2.0,
        board_w=30.0,
    ),
)

_CC2420_V = 3.0
_CC2420_TX_A = {
    0.0: 17.4e-3,
    -1.0: 16.5e-3,
    -3.0: 15.2e-3,
    -5.0: 13.9e-3,
    -7.0: 12.5e-3,
    -10.0: 11.2e-3,
    -15.0: 9.9e-3,
    -25.0: 8.5e-3,
}
_WAVELAN_V = 4.74
_WIFI_NS3_V = 3.0

_RADIOS = (
    Radio(
        name="cc2420",
        description="Chipcon CC2420, IEEE 802.15.4 at 2.4 GHz",
        source=(
            "CC2420 data sheet (SWRS041): current consumption and output power settings, at 3.0 V; "
            "sleep is power-down with the regulator on, 20 uA; with the crystal on (idle) 426 uA"
        ),
        standard="ieee802154",
        supply_v=_CC2420_V,
        sleep_w=20e-6 * _CC2420_V,
        listen_w=18.8e-3 * _CC2420_V,
        receive_w=18.8e-3 * _CC2420_V,
        transmit_table_w=MappingProxyType({dbm: amps * _CC2420_V for dbm, amps in _CC2420_TX_A.items()}),
        crystal_w=426e-6 * _CC2420_V,
    ),
    Radio(
        name="wavelan_silver",
        description="Lucent WaveLAN PC card Silver, IEEE 802.11b",
        source=(
            "Feeney, Nilsson, INFOCOM 2001, table 1 (measured at 11 Mbit/s, 4.74 V): 10 mA asleep, 156 mA "
            "idle, 190 mA receiving, 284 mA sending, quoted from memory; 15 dBm is the nominal output of "
            "cards of its kind"
        ),
        standard="ieee80211b",
        supply_v=_WAVELAN_V,
        sleep_w=10e-3 * _WAVELAN_V,
        listen_w=156e-3 * _WAVELAN_V,
        receive_w=190e-3 * _WAVELAN_V,
        transmit_table_w=MappingProxyType({15.0: 284e-3 * _WAVELAN_V}),
    ),
    Radio(
        name="wifi_ns3",
        description="The Wi-Fi card of ns-3's energy model",
        source=(
            "ns-3 3.37, WifiRadioEnergyModel, defaults: 380 mA sending, 313 mA receiving, 273 mA idle, 33 mA "
            "asleep, at 3.0 V, whatever the output power; they go back to an 802.11n card (Halperin et al., "
            "HotPower 2010)"
        ),
        standard="ieee80211b",
        supply_v=_WIFI_NS3_V,
        sleep_w=33e-3 * _WIFI_NS3_V,
        listen_w=273e-3 * _WIFI_NS3_V,
        receive_w=313e-3 * _WIFI_NS3_V,
        transmit_table_w=MappingProxyType({20.0: 380e-3 * _WIFI_NS3_V}),
    ),
)

_IMAGERS = (
    Imager(
        name="cmos",
        description="Low-power CMOS image sensor",
        source=(
            "LiKamWa et al., MobiSys 2013: 13.1 + 5.1e-6 f mW while reading out, 4.4 + 3.35e-6 f mW idle, f "
            "the pixel clock [Hz]; the clock of 6 MHz is a choice of ours that reads QVGA in 12.8 ms"
        ),
        active_base_w=13.1e-3,
        active_j_per_tick=5.1e-9,
        idle_base_w=4.4e-3,
        idle_j_per_tick=3.35e-9,
        pixel_clock_hz=6e6,
    ),
)

_BATTERIES = (
    Battery("two_aa", "two alkaline AA cells", "18,720 J, the initial energy of Castalia's nodes", 18_720.0),
    Battery("mains", "never empty", "by definition", None),
)

PLATFORMS: Mapping[str, Platform] = MappingProxyType({p.name: p for p in _PLATFORMS})
RADIOS: Mapping[str, Radio] = MappingProxyType({r.name: r for r in _RADIOS})
IMAGERS: Mapping[str, Imager] = MappingProxyType({i.name: i for i in _IMAGERS})
BATTERIES: Mapping[str, Battery] = MappingProxyType({b.name: b for b in _BATTERIES})
