#!/usr/bin/env python3
"""Run ROS 1's ``fixbag.py``."""

import sys

from rosz.ros1.rosbag.programs import run_fixbag

sys.exit(run_fixbag(sys.argv[1:]))
