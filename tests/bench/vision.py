"""Conversions of images and clouds: rosz beside ROS 1, in turn.

``python -m tests.bench.vision [ROUNDS]`` prints the best time of each in milliseconds.
"""

from __future__ import annotations

import json
import subprocess
import sys

__all__ = ("main",)

_REAL = "/usr/bin/python3"
_PROGRAM = """
import json, time
import numpy as np
import sensor_msgs.point_cloud2 as pc2
from cv_bridge import CvBridge
from laser_geometry import LaserProjection
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header
bridge = CvBridge()
picture = np.random.RandomState(1).randint(0, 256, (1080, 1920, 3)).astype(np.uint8)
image = bridge.cv2_to_imgmsg(picture, "bgr8")
packed = bridge.cv2_to_compressed_imgmsg(picture)
points = np.random.RandomState(1).uniform(-9, 9, (300000, 3)).astype(np.float32)
points[::7, 1] = np.nan
listed = points.tolist()
cloud = pc2.create_cloud_xyz32(Header(), listed)
scan = LaserScan(angle_min=-2, angle_max=2, angle_increment=4 / 1080, range_min=0.1, range_max=30,
    ranges=[1 + at / 100 for at in range(1080)], intensities=[1.0] * 1080)
projection = LaserProjection()
tasks = {
    "image to array": lambda: bridge.imgmsg_to_cv2(image),
    "image to array, bgr8": lambda: bridge.imgmsg_to_cv2(image, "bgr8"),
    "image to array, rgb8": lambda: bridge.imgmsg_to_cv2(image, "rgb8"),
    "image to array, mono8": lambda: bridge.imgmsg_to_cv2(image, "mono8"),
    "array to image": lambda: bridge.cv2_to_imgmsg(picture, "bgr8"),
    "JPEG to array": lambda: bridge.compressed_imgmsg_to_cv2(packed),
    "array to JPEG": lambda: bridge.cv2_to_compressed_imgmsg(picture),
    "read 300 000 points": lambda: sum(1 for _ in pc2.read_points(cloud)),
    "read them, no NaN": lambda: sum(1 for _ in pc2.read_points(cloud, skip_nans=True)),
    "read them as a list": lambda: pc2.read_points_list(cloud),
    "make a cloud of lists": lambda: pc2.create_cloud_xyz32(Header(), listed),
    "make a cloud of an array": lambda: pc2.create_cloud_xyz32(Header(), points),
    "project a scan": lambda: projection.projectLaser(scan),
}
def taken(task):
    start = time.perf_counter()
    task()
    return (time.perf_counter() - start) * 1000
print(json.dumps({name: min(taken(task) for _ in range(5)) for name, task in tasks.items()}))
"""


def _run(interpreter: str, head: str = "") -> dict[str, float]:
    done = subprocess.run(
        [interpreter, "-c", head + _PROGRAM], check=True, capture_output=True, text=True
    )
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def main() -> None:
    """Measure both in turn and print the figures."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    pairs = [(_run(sys.executable, "import rosz.ros1"), _run(_REAL)) for _ in range(rounds)]
    print(f"{'ms':26}{'rosz':>10}{'ROS 1':>10}")
    for name in pairs[0][0]:
        ours, real = (min(pair[side][name] for pair in pairs) for side in (0, 1))
        print(f"{name:26}{ours:10.3f}{real:10.3f}")


if __name__ == "__main__":
    main()
