"""Messages of bags as tables, pictures, videos and plots. May import introspect and images."""

from rosz.lazy import exports_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from rosz.bags.export.images import IMAGE_TYPES, ImageFiles, Video, VideoTimes
    from rosz.bags.export.plotting import check_format, draw, find_curves, read_curves
    from rosz.bags.export.tables import Tables, file_names
else:
    __getattr__ = exports_of(__name__)
