"""A camera on a mote: it takes an image at every tracking step, at the cost of its imager's power."""

from wsnsim.hardware.profiles import Imager
from wsnsim.net.clock import Clock
from wsnsim.sim.node import Node
from wsnsim.sim.recording import ImageRecorder
from wsnsim.systems.base import Sensor
from wsnsim.types import ByteArray, Seconds
from wsnsim.units import to_ns
from wsnsim.vision.frame import Frame
from wsnsim.vision.renderer import Renderer
from wsnsim.world.world import World


class MoteCamera:
    """Takes frames and gives them to the program of its mote.

    The image shows the instant of the trigger; the program has it when the
    imager has read it out.

    Parameters
    ----------
    recorder : keeps the frames that the scenario asks for
    sensor : measures beside the image, where the system has such
    """

    def __init__(
        self,
        clock: Clock,
        node: Node,
        renderer: Renderer,
        imager: Imager,
        world: World,
        recorder: ImageRecorder,
        sensor: Sensor | None = None,
    ) -> None:
        self.node = node
        self.sensor = sensor
        self._recorder = recorder
        self.renderer = renderer
        self._clock = clock
        self._world = world
        self._reading_out = False
        self._readout_ns = to_ns(imager.capture_seconds(renderer.camera.resolution_px))

    def trigger(self, step: int, time: Seconds) -> None:
        """Take frame `step` now, unless the mote is dead, or its processor or the imager still busy."""
        if not self.node.alive:
            return
        if self.node.busy or self._reading_out:
            what = "the processor was busy" if self.node.busy else "the imager was still reading out"
            self.node.skip_frame(step, what)
            return
        self.node.images_taken += 1
        self._reading_out = True
        self.node.power.camera(active=True)
        measured = None if self.sensor is None else self.sensor.measured(step, time)
        frame = Frame(step, time, self.node.id, lambda: self._render(step, time), measured)
        self._clock.call(self._readout_ns, lambda: self._hand_over(frame))

    def _hand_over(self, frame: Frame) -> None:
        self._reading_out = False
        self.node.power.camera(active=False)
        if self.node.alive:
            self._recorder.keep(frame)
        self.node.take_frame(frame)

    def _render(self, step: int, time: Seconds) -> ByteArray:
        return self.renderer.render(step, self._world.moving_bodies, self._world.moving_at(time))
