#!/usr/bin/env python3
"""Run ROS 1's ``savemsg.py``."""

import sys

from rosz.ros1.rosbag.programs import run_savemsg

sys.exit(run_savemsg(sys.argv[1:]))
