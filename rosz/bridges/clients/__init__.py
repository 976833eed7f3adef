"""Servers for clients by websocket: connections, outgoing queues, and topics that clients share.

`rosz.bridges.rosbridge` and `rosz.bridges.foxglove` add their protocols. Needs the library
websockets, which the extras of both install.
"""

from rosz.bridges.clients.queues import OutgoingQueue, TopicMessage, TopicQueue
from rosz.bridges.clients.server import WRONG_TOO_OFTEN, WebsocketServer, host_of, pieces, place
from rosz.bridges.clients.settings import BridgeSettings, ClientLimits
from rosz.bridges.clients.tasks import ClientTasks, Task, task_worker
from rosz.bridges.clients.topics import ClientTopics, build
