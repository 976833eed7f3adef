"""Pictures of nodes and topics, as rqt_graph draws them; pure.

``picture`` chooses nodes and topics, ``layers`` gives them a layout, ``drawing`` writes it as SVG,
DOT or Mermaid.
"""

from rosz.diagram.drawing import labels_of, write_dot, write_mermaid, write_svg
from rosz.diagram.picture import CONTENTS, Box, Content, Picture, PictureOptions, make_picture
