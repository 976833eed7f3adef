"""image_geometry beside ROS 1's."""

from __future__ import annotations

import oracle
import pytest

SNIPPET = """
import numpy as np
from image_geometry import PinholeCameraModel, StereoCameraModel
from image_geometry.cameramodels import mkmat
from sensor_msgs.msg import CameraInfo, RegionOfInterest
from std_msgs.msg import Header
def info(tx=0.0, **options):
    given = dict(width=64, height=48, D=[0.3, -0.2, 0.001, 0.002, 0.1],
        K=[50.5, 0, 31.5, 0, 51.5, 23.25, 0, 0, 1], R=[1, 0, 0, 0, 0.8, -0.6, 0, 0.6, 0.8],
        P=[48.0, 0, 30, tx, 0, 49, 22, 0.5, 0, 0, 1, 0], header=Header(frame_id="camera"))
    return CameraInfo(**{**given, **options})
def model(**options):
    made = PinholeCameraModel()
    made.fromCameraInfo(info(**options))
    return made
def all_of(camera):
    raw = np.arange(48 * 64 * 3, dtype=np.uint32).reshape(48, 64, 3).astype(np.uint8)
    rectified = np.zeros_like(raw)
    camera.rectifyImage(raw, rectified)
    return [
        *([type(m).__name__, m] for m in (camera.intrinsicMatrix(), camera.rotationMatrix(),
            camera.projectionMatrix(), camera.fullIntrinsicMatrix(),
            camera.fullProjectionMatrix())),
        camera.distortionCoeffs(), camera.fullResolution(), camera.width, camera.height,
        camera.binning_x, camera.binning_y, camera.cx(), camera.cy(), camera.fx(), camera.fy(),
        camera.Tx(), camera.Ty(), camera.fovX(), camera.fovY(), camera.tfFrame(),
        [getattr(camera.raw_roi, name) for name in ("x_offset", "y_offset", "width", "height")],
        camera.rectifyPoint((10, 20)), camera.project3dToPixel((0.5, -0.25, 2)),
        [str(one) for one in camera.project3dToPixel((1, 2, 0))],
        camera.project3dToPixel([1.0, 2.0, 4.0, 9.0]), camera.projectPixelTo3dRay((12, 3.5)),
        camera.getDeltaU(2, 3), camera.getDeltaV(2, 3), camera.getDeltaX(2, 3),
        camera.getDeltaY(2, 3), str(camera.getDeltaU(1, 0)), str(camera.getDeltaV(1, 0)),
        (camera.projectionMatrix() * mkmat(4, 1, [1, 2, 3, 1])).tolist(), camera.mapx.shape[:2],
        rectified[20, 30],
    ]
stereo = StereoCameraModel()
stereo.fromCameraInfo(info(), info(-4.8))
unset = PinholeCameraModel()
result = [
    all_of(model()), all_of(model(D=[])), all_of(model(binning_x=2, binning_y=4)),
    all_of(model(roi=RegionOfInterest(x_offset=8, y_offset=4, width=32, height=16), binning_x=2)),
    [unset.K, unset.stamp, unset.width],
    stereo.Q, stereo.tfFrame(), stereo.project3dToPixel((0.5, 0.25, 2)),
    stereo.projectPixelTo3d((30, 20), 2.5), stereo.projectPixelTo3d((30, 20), 0), stereo.getZ(2.5),
    stereo.getDisparity(1.5), str(stereo.getZ(0)), str(stereo.getDisparity(0)),
    stereo.left.Tx(), stereo.right.Tx(),
]
"""


@pytest.mark.filterwarnings("ignore:the matrix subclass")  # as in the snippet
@pytest.mark.ros1
def test_models_are_those_of_ros_1() -> None:
    pytest.importorskip("cv2")
    oracle.same(SNIPPET, "image_geometry", "python3-image-geometry")
