#!/usr/bin/env python3
"""Print the transform between two frames."""

from rosz.programs.tf import tf_echo

tf_echo()
