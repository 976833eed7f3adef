"""The package of `cv_bridge_boost`, which ROS 1 has in C++; may import numpy and OpenCV."""

PUBLIC_MODULES = ("cv_bridge_boost",)

__all__: tuple[str, ...] = ()
