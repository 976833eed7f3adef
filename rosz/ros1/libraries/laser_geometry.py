"""laser_geometry: laser scans as point clouds (ROS wiki, laser_geometry).

Needs the extra ``rosz[numpy]``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rosz.msgs.sensor_msgs.msg import PointCloud2
from rosz.ros1.libraries.ros_numpy import array_to_pointcloud2


class LaserProjection:
    """Makes point clouds of laser scans.

    Readings out of the scan's range are left out. A cloud has the fields x, y and z, then those of
    the options: ``intensity``, ``index`` (of the reading in the scan), ``distances`` (metres),
    ``stamps`` (seconds since the start of the scan) and ``vp_x``, ``vp_y`` and ``vp_z`` (zeros).
    """

    LASER_SCAN_INVALID = -1.0
    LASER_SCAN_MIN_RANGE = -2.0
    LASER_SCAN_MAX_RANGE = -3.0

    class ChannelOption:
        """Fields of a cloud beside x, y and z; several are added by ``|``."""

        NONE = 0x00
        INTENSITY = 0x01
        INDEX = 0x02
        DISTANCE = 0x04
        TIMESTAMP = 0x08
        VIEWPOINT = 0x10
        DEFAULT = INTENSITY | INDEX

    def __init__(self) -> None:
        self._key: tuple[float, ...] = ()
        self._cos_sin: Any = None

    def projectLaser(  # noqa: N802  # ROS 1's
        self,
        scan_in: Any,
        range_cutoff: float = -1.0,
        channel_options: int = ChannelOption.DEFAULT,
    ) -> PointCloud2:
        """Return the cloud of a LaserScan, in the frame of the scan.

        Args:
            scan_in: The scan.
            range_cutoff: Distance in metres from which on readings are left out; the range of the
                scan when negative or farther.
            channel_options: Further fields of the cloud.

        Raises:
            IndexError: The scan has intensities, but not one for each reading.
        """
        ranges = np.asarray(scan_in.ranges, np.float64)
        limit = scan_in.range_max if range_cutoff < 0 else min(range_cutoff, scan_in.range_max)
        kept = np.flatnonzero((ranges < limit) & (ranges >= scan_in.range_min))
        x, y = (ranges * self._directions(scan_in, len(ranges)))[:, kept]
        columns = [("x", x), ("y", y), ("z", 0.0)]
        option = self.ChannelOption
        if channel_options & option.INTENSITY and len(scan_in.intensities):
            columns.append(("intensity", np.asarray(scan_in.intensities)[kept]))
        if channel_options & option.INDEX:
            columns.append(("index", kept))
        if channel_options & option.DISTANCE:
            columns.append(("distances", ranges[kept]))
        if channel_options & option.TIMESTAMP:
            columns.append(("stamps", kept * scan_in.time_increment))
        if channel_options & option.VIEWPOINT:
            columns += [(name, 0.0) for name in ("vp_x", "vp_y", "vp_z")]
        return _cloud(scan_in.header, columns, len(kept))

    def _directions(self, scan: Any, count: int) -> Any:
        """Return cosine and sine of each reading, of the last scan if they are the same."""
        key = (count, scan.angle_min, scan.angle_max, scan.angle_increment)
        if key != self._key:
            angles = scan.angle_min + np.arange(count) * scan.angle_increment
            self._key, self._cos_sin = key, np.array([np.cos(angles), np.sin(angles)])
        return self._cos_sin


def _cloud(header: Any, columns: list[tuple[str, Any]], count: int) -> PointCloud2:
    kinds = [(name, np.int32 if name == "index" else np.float32) for name, _ in columns]
    points = np.empty(count, np.dtype(kinds))
    for name, values in columns:
        points[name] = values
    cloud: PointCloud2 = array_to_pointcloud2(points)
    cloud.header, cloud.is_dense = header, False
    return cloud
