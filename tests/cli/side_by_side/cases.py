"""The commands that are compared, and where they differ, with the reason of each difference."""

from __future__ import annotations

INTERRUPTED = {
    "topic hz /counter",
    "topic bw /counter",
    "topic delay /counter",
    "topic echo /nowhere",
}
"""What goes on for ever, and is ended as by Ctrl-C after it has said something."""

COMMANDS = """\
topic list
topic list -v
topic list -p
topic list -s
topic list /robot
topic list -p -s
topic info /chatter
topic info /robot/pose
topic info /nowhere
topic type /chatter
topic type /robot/pose/pose/position
topic type /robot/pose/pose/position/x
topic type /robot/pose/nothing
topic type /nowhere
topic find std_msgs/String
topic echo -n 2 /chatter
topic echo -n 1 /counter
topic echo -n 1 /robot/pose
topic echo -n 1 /robot/pose/pose/position
topic echo -n 1 /robot/pose/pose/position/x
topic echo -n 1 /robot/pose/header/stamp
topic echo -n 1 /robot/joints/position[1]
topic echo -n 1 /robot/joints/name
topic echo -n 1 /robot/joints
topic echo -n 1 --noarr /robot/joints
topic echo -n 1 --nostr /robot/pose
topic echo -n 1 -p /robot/pose
topic echo -n 1 -p /robot/joints
topic echo -n 1 -p /robot/pose/pose/position/x
topic echo -n 1 -w 6 /robot/pose/pose
topic echo -n 1 --filter m.data>5 /counter
topic echo /nowhere
topic echo
topic hz /counter
topic bw /counter
topic delay /counter
topic hz
topic pub -1 /cmd std_msgs/String hello
topic pub -1 /cmd std_msgs/String {data: hello}
topic pub -1 /cmd std_msgs/Int32 hello
topic pub -1 /cmd std_msgs/String hello there
topic pub -1 /cmd nothing/Nothing 1
topic nothing
service list
service list -n
service list /robot
service info /power
service info /nowhere
service type /power
service type /nowhere
service find std_srvs/SetBool
service find nothing/Nothing
service args /power
service args /robot/reset
service args /robot/plan
service args /nowhere
service node /power
service uri /power
service call /power true
service call /power {data: false}
service call /power
service call /power 1 2
service call /robot/reset
service call /robot/plan {tolerance: 0.5}
service call /robot/plan {tolerance: far}
service call /robot/plan {width: 1}
service call /nowhere
service info /robot/plan
node list
node list -a
node list -u
node list /talk
node info /listener
node info /nowhere
node ping -c 1 /talker
node ping -c 1 /nowhere
node ping -a
node machine
node machine nowhere
param list
param list /robot
param list /nowhere
param get /robot/name
param get /robot/wheels
param get /robot/flags
param get /listener
param get -p /robot
param get /nowhere
param set /robot/name c3
param get /robot/name
param set /robot/size {width: 1, height: 2.5}
param get /robot/size
param get /robot
param set /robot/text 'seven'
param get /robot/text
param delete /robot/size
param get /robot/size
param delete /nowhere
param set -v /odd/list [1,two,3.5]
param set -v /odd/more {b: yes, a: rad(pi)}
param set /odd/angle 'deg(90)'
param get -v /odd/angle
param get -v /odd
param dump -v /dev/stdout /odd
param dump /dev/stdout /odd/angle
param dump -v file.yaml /odd
param load -v file.yaml /copy
param get /copy
param load -v src/demo_pkg/param/arms.yaml /spaces
param get -v /spaces
param delete -v /copy/list
param delete -v /copy
param get
param nothing
msg show std_msgs/String
msg show std_msgs/Header
msg show std_msgs/MultiArrayLayout
msg show demo_pkg/Reading
msg show Reading
msg show -r demo_pkg/Reading
msg show nothing/Nothing
msg md5 std_msgs/String
msg md5 geometry_msgs/Twist
msg md5 demo_pkg/Reading
msg md5 Reading
msg md5 nothing/Nothing
msg package std_msgs
msg package -s demo_pkg
msg package nothing
msg packages
msg list
srv show demo_pkg/Ask
srv show Ask
srv show -r demo_pkg/Ask
srv show nothing/Nothing
srv md5 demo_pkg/Ask
srv package demo_pkg
srv packages
srv list
""".splitlines()

_USAGE = "a wrong command line is one line and code 2, for all of rosz's commands"
_REFUSED = "what cannot be done is no success: code 1"
_SHIPPED = "rosz brings more types than the ROS 1 packages of this machine"
_BUILT = "ROS 1 must have built a package to tell a hash of it"

DIFFERENCES = {
    "topic delay /counter": "a topic without a header is told once and ends it, not per message",
    "topic pub -1 /cmd std_msgs/Int32 hello": "rosz refuses a value that ROS 1 quietly drops",
    "topic nothing": _USAGE,
    "service call /robot/plan {tolerance: far}": "ROS 1 ends in a traceback, with Python's code",
    "node info /listener": "tells the command line; a link to another node has no socket to tell",
    "node info /nowhere": _REFUSED,
    "node ping -c 1 /nowhere": _REFUSED,
    "param nothing": _USAGE,
    "msg md5 demo_pkg/Reading": _BUILT,
    "msg md5 Reading": _BUILT,
    "srv md5 demo_pkg/Ask": _BUILT,
    "msg md5 nothing/Nothing": _REFUSED,
    "msg package nothing": "code 1, as for all that is not there; ROS 1's is 64",
    "msg packages": _SHIPPED,
    "msg list": _SHIPPED,
    "srv packages": _SHIPPED,
    "srv list": _SHIPPED,
}
"""Commands of which something differs after normalising, each with the reason."""
