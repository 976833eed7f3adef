"""ros_numpy.occupancy_grid: OccupancyGrid as a masked array of rows and columns."""

from __future__ import annotations

from typing import Any

import numpy as np

from rosz.msgs.nav_msgs.msg import MapMetaData, OccupancyGrid
from rosz.ros1.ros_numpy.registry import converts_from_numpy, converts_to_numpy

__all__ = ("numpy_to_occupancy_grid", "occupancygrid_to_numpy")

_UNKNOWN = -1
_DIMENSIONS = 2


@converts_to_numpy(OccupancyGrid)
def occupancygrid_to_numpy(msg: OccupancyGrid) -> Any:
    """Return the cells, with those that are unknown (-1) masked."""
    cells = np.asarray(msg.data, np.int8).reshape(msg.info.height, msg.info.width)
    return np.ma.array(cells, mask=cells == _UNKNOWN, fill_value=_UNKNOWN)


@converts_from_numpy(OccupancyGrid)
def numpy_to_occupancy_grid(arr: Any, info: MapMetaData | None = None) -> OccupancyGrid:
    """Return the grid of an array of cells; masked ones keep the values below the mask.

    Args:
        arr: The cells.
        info: Resolution and origin; width and height are set.

    Raises:
        TypeError: The array has another type than int8, or is not of rows and columns.
    """
    if arr.ndim != _DIMENSIONS:
        raise TypeError(f"expected an array of rows and columns, got one of shape {arr.shape}")
    if arr.dtype != np.int8:
        raise TypeError(f"expected cells of int8, got {arr.dtype.name}")
    cells: Any = arr.data if isinstance(arr, np.ma.MaskedArray) else arr
    grid = OccupancyGrid(info=info or MapMetaData(), data=cells.ravel())
    grid.info.height, grid.info.width = cells.shape
    return grid
