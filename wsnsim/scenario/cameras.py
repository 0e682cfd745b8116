"""The calibrated camera that an entry of `cameras:` describes: made here and nowhere else."""

import math

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.scenario.schema_cameras import Camera


def focal_length_px(camera: Camera) -> float:
    """Return the focal length as given, or (w / 2) / tan(fov / 2) of the horizontal field of view [px]."""
    if camera.focal_px is not None:
        return camera.focal_px
    if camera.fov_deg is None:
        raise ValueError("must have a focal_px or a fov_deg")
    return 0.5 * camera.resolution_px[0] / math.tan(0.5 * math.radians(camera.fov_deg))


def pinhole(camera: Camera) -> PinholeCamera:
    """Return a scenario's camera with its pose, focal length and lens.

    Raises
    ------
    ValueError : it looks nowhere, or its lens sends no ray to the corners of the image
    """
    focal_px, resolution_px = focal_length_px(camera), camera.resolution_px
    if camera.look_at_m is not None:
        return PinholeCamera.look_at(
            camera.position_m, camera.look_at_m, focal_px, resolution_px, camera.distortion
        )
    angles = [math.radians(angle or 0.0) for angle in (camera.yaw_deg, camera.pitch_deg, camera.roll_deg)]
    yaw, pitch, roll = angles
    return PinholeCamera.at_angles(
        camera.position_m, yaw, pitch, roll, focal_px, resolution_px, camera.distortion
    )
