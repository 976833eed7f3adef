#!/usr/bin/env python3
"""Connect a device on a serial line, or devices by TCP."""

from rosz.programs.rosserial import main

main()
