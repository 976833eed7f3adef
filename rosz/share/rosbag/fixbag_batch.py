#!/usr/bin/env python3
"""Run ROS 1's ``fixbag_batch.py``."""

import sys

from rosz.ros1.rosbag.programs import run_fixbag_batch

sys.exit(run_fixbag_batch(sys.argv[1:]))
