#!/usr/bin/env python3
"""Draw the tree of frames."""

from rosz.programs.tf import view_frames

view_frames()
