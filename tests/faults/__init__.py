"""What breaks around nodes: processes, disks, descriptors, clocks. Figures show with ``-s``."""
