"""Recording topics and parameters into bags. May import nodes and the formats."""

from rosz.bags.record.parameters import ParameterRecord
from rosz.bags.record.recorder import Recorder
from rosz.bags.record.recording import BagFiles, Sink
from rosz.bags.record.ring import Ring
from rosz.bags.record.selection import RecordOptions, Selection

__all__ = ("BagFiles", "ParameterRecord", "RecordOptions", "Recorder", "Ring", "Selection", "Sink")
