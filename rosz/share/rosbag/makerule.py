#!/usr/bin/env python3
"""Run ROS 1's ``makerule.py``."""

import sys

from rosz.ros1.rosbag.programs import run_makerule

sys.exit(run_makerule(sys.argv[1:]))
