"""Images: what their encodings mean, as arrays of numpy, and as pictures.

Needs the extra ``rosz[vision]``. May import message classes, numpy and OpenCV.
"""

from rosz.images.arrays import convert, image_array, saturated, without_channel
from rosz.images.encodings import Encoding, ImageError, depth_of, parse_encoding, type_of
from rosz.images.pictures import pixels
