"""Pictures of a target taken before the run, from which a tracker learns what it looks like."""

from dataclasses import dataclass

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.rotations import quaternion_to_matrix
from wsnsim.rng import RandomStreams
from wsnsim.types import ByteArray, FloatArray
from wsnsim.vision.renderer import look
from wsnsim.world.bodies import Body


@dataclass(frozen=True, eq=False)
class Portrait:
    """An image of a target alone, and the camera that took it.

    Parameters
    ----------
    image : (h, w, 3) RGB
    camera : with the target's centre at the origin
    orientation : (4,) unit quaternion of the target (w, x, y, z)
    """

    image: ByteArray
    camera: PinholeCamera
    orientation: FloatArray


@dataclass(frozen=True, eq=False)
class Studio:
    """Takes portraits of one target under the light of the scene.

    Parameters
    ----------
    body : the target
    orientation : (4,) how it stands (w, x, y, z)
    light : (3,) unit vector towards the light
    ambient : share of the light that comes from everywhere
    focal_px, resolution_px : of the camera [px]
    distance_m : from camera to target centre [m]
    noise_sd : standard deviation of the pixel noise [grey levels]
    streams : of the run; each direction has its own noise
    name : the target's name, which tells its noise from another's
    """

    body: Body
    orientation: FloatArray
    light: FloatArray
    ambient: float
    focal_px: float
    resolution_px: tuple[int, int]
    distance_m: float
    noise_sd: float
    streams: RandomStreams
    name: str

    def portrait(self, direction: FloatArray) -> Portrait:
        """Photograph the target from `direction` (3,), a unit vector in its own axes."""
        position = quaternion_to_matrix(self.orientation) @ (self.distance_m * direction)
        camera = PinholeCamera.look_at(position, np.zeros(3), self.focal_px, self.resolution_px)
        clean, _ = look(self.body, self.orientation, camera, self.light, self.ambient)
        key = (round(1e6 * (component + 1.0)) for component in direction)
        noise = self.streams.stream("portrait", self.name, *key).standard_normal(clean.shape)
        image = np.clip(np.rint(clean + self.noise_sd * noise), 0, 255).astype(np.uint8)
        return Portrait(image, camera, self.orientation)
