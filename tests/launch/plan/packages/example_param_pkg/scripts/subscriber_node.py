#!/usr/bin/env python3
"""Stand in for a node that launch files name."""
