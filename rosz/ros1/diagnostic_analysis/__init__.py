"""diagnostic_analysis: recorded diagnostics as CSV files (ROS wiki, diagnostic_analysis).

May import rosbag and Python's library.
"""

from __future__ import annotations

PUBLIC_MODULES = ("exporter", "sparse")

__all__: tuple[str, ...] = ()
