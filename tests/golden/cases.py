"""The commands whose output is frozen, and whether there are nodes to ask.

What ``tests/cli/side_by_side`` holds against ROS 1 already is left out.
"""

from __future__ import annotations

__all__ = ("ALONE", "AMONG_NODES")

ALONE = {
    "usage": """\

nothing
topi list
topic lst
topic echo
topic list --nope
topic pub /x
topic hz -w many /x
param set
param get /a /b
param get bad//name
service call
node ping -c x /a
log --level loud
log level a
launch
launch --nope
run demo_pkg
keys list --days
doctor --wait -1
turtlesim snapshot picture.jpg
env csh
gen nothing
reconfigure set /a
""",
    "nobody": """\
topic list
topic echo -1 /a
topic pub -1 /a std_msgs/Nothing
service call /a
node list --json
node ping -c 1 /a
node ping -a
node kill -a
node cleanup
reconfigure get /a
param get /a
param set /a 1
log level a rosout debug
doctor
doctor --json
turtlesim snapshot picture.png
launch --status
launch --restart /a
core | head -3
core --store params.db | head -3
core --listen nonsense
""",
    "types": """\
msg show std_msgs/String
msg show demo_pkg/Reading
msg show --json demo_pkg/Reading
msg info -r demo_pkg/Reading
msg hash std_msgs/String
msg hash demo_pkg/Reading
msg md5 --json std_msgs/String
msg show String
msg show std_msgs/Strng
msg show geometry_msgs/msg/Point
msg show std_msgs
msg package --json demo_pkg
msg package -s std_msgs
msg packages -s
msg packages --json
msg list
msg show <<< Point\\n
srv show demo_pkg/Ask
srv show --json demo_pkg/Ask
srv info std_srvs/SetBool
srv hash std_srvs/SetBool
srv md5 std_srvs/SetBool
srv md5 demo_pkg/Ask
srv hash demo_pkg/Ask
srv package std_srvs
srv packages
srv list
srv list --json
gen --check demo_pkg
gen demo_pkg
gen --check demo_pkg
gen -o out demo_pkg
gen broken/broken_pkg
gen
""",
    "packages": """\
pkg list
pkg list -n
pkg list --json
pkg find demo_pkg
pkg find --json demo_pkg
pkg find demo_pgk
pkg find
pkg check
pkg check demo_pkg
pkg check broken
pkg check --json broken
pkg check nothing
pkg create -m me -l MIT -d text fresh std_msgs
pkg check fresh
pkg create fresh
pkg create Bad-Name
pkg create --bare plain
pkg check --setup
run demo_pkg beep.py one two
run -d demo_pkg beep.py x:=y
run -p echo demo_pkg beep.py
run demo_pkg beep
run nothing beep
env
env zsh
env fish
env --json
keys init secrets
keys init secrets
keys list -d secrets
keys list -d secrets --json
keys check secrets
keys check nothing
keys list -d nothing
keys add -d nothing robot
""",
    "launch": """\
launch --nodes demo_pkg demo.launch topic:=chat
launch --nodes demo_pkg demo.launch topic:=chat rate:=1
launch --args /a/talker demo_pkg demo.launch topic:=chat
launch --args /nobody demo_pkg demo.launch topic:=chat
launch --find-node /more/listener demo_pkg demo.launch topic:=chat
launch --find-node /nobody demo_pkg demo.launch topic:=chat
launch --files demo_pkg demo.launch topic:=chat
launch --ros-args demo_pkg demo.launch
launch --dump-params demo_pkg demo.launch topic:=chat
launch --dump-plan demo_pkg demo.launch topic:=chat
launch --dump-params - <<< <launch><param name="a" value="1"/></launch>
launch --dump-params - <<< <launch><rosparam>a: [1</rosparam></launch>
launch --nodes demo_pkg demo.launch
launch --nodes demo_pkg nothing.launch
launch --nodes nothing demo.launch
launch --nodes nothing.launch
launch --nodes demo_pkg demo.launch topic:=chat unknown:=1
launch --nodes broken/no_xml.launch
launch --dump-plan broken/no_tag.launch
launch --nodes broken/no_arg.launch
launch --nodes broken/ring.launch
launch --nodes broken/broken_pkg/launch/bad.launch
launch --dump-params sh.launch
launch --nodes broken/no_package.launch
launch broken/no_package.launch
""",
}
"""Commands by the file of their output, with nobody there."""

AMONG_NODES = {
    "topic": """\
topic list -t
topic list --json
topic list -v --json
topic list --host
topic info --json /chatter
topic type --json /robot/pose
topic find --json std_msgs/Int32
topic find std_msgs/Nothing
topic echo -n 1 --json /robot/pose
topic echo -1 --json /robot/pose/pose/position
topic echo -1 --raw /counter
topic echo -1 --offset /robot/pose/header
topic echo -1 --nostr --noarr /robot/joints
topic echo -1 -p -w 8 /robot/pose/pose
topic echo -1 --filter "m.data=='hello'" /chatter
topic echo -1 --filter 'm.data>>' /chatter
topic echo -1 --filter m.nothing==1 /chatter
topic echo -1 /robot/pose/nothing | head -1
topic echo -1 /robot/joints/position[7] | head -1
topic echo -1 /chater | head -1
topic hz /counter | head -3
topic hz --json /counter | head -1
topic bw /counter | head -3
topic bw --json /counter | head -1
topic pub -1 -v /out std_msgs/String hello
topic pub -1 /chatter std_msgs/Int32 7
topic pub -1 -v -s /out std_msgs/Header '{frame_id: map, stamp: now}'
topic pub -1 /out std_msgs/Int32 2147483648
topic pub -1 /out std_msgs/String '{data: [1'
topic pub -1 /out std_msgs/String '{dat: x}'
topic pub -r 50 -v -f texts.yaml /out std_msgs/String | head -3
topic pub -f bad.yaml /out std_msgs/String
topic pub -f nothing.yaml /out std_msgs/String
topic pub -v /out std_msgs/Int32 <<< data: 1\\n---\\ndata: 2\\n
topic pub -r 0 /out std_msgs/Int32 1
""",
    "service": """\
service list -t
service list --json
service list -n --json
service info --json /power
service type --json /power
service find --json std_srvs/SetBool
service args --json /power
service node --json /power
service uri --json /power
service call -v /power true
service call --json /power true
service call /power '{data: 7}'
service call /power '{data: [1'
service call /powr true
service call /arm/fail true
service call --timeout -1 /power true
""",
    "node": """\
node list --json
node list /arm
node info -q /listener
node info --json /listener
node info /talker /arm/robot
node info /talkr
node machine --json
node ping -c 2 /arm/robot
log levels /arm/robot
log level /arm/robot rosout error
log levels /arm/robot
log level /arm/robot rosout loud
log level /nobody rosout debug
log level /arm/robot rosout warn
log -n 1 /arm/robot
log -n 1 --json /arm/robot
log -n 1 -v --grep hurts
doctor
doctor --json
turtlesim snapshot picture.png
turtlesim snapshot --node /arm/robot picture.png
node kill /nobody
node kill /arm/robot
node list
""",
    "param": """\
param list --json
param get --json /robot
param get -v /robot/name
param get /robt
param set -v /a/b '{c: 1, d: [x, 2.5, true]}'
param get -p /a
param set /a/b '{d: 2}'
param get /a
param set /text -t text.txt
param set /bytes -b text.txt
param get --json /bytes
param set /number -- -1
param set /number -1.5e3
param set /yaml - <<< [1, 2]\\n
param set /bad '[1'
param set /angle 'deg(180)'
param get /angle
param set /angle 'rad(pi/2)'
param get /angle
param set /none null
param set bad//name 1
param search name /robot/arm
param search --json name /robot/arm
param search nothing
param dump
param dump --json
param dump dump.yaml /robot
param load --dry-run good.yaml
param load --dry-run --json good.yaml
param load -v good.yaml
param get /robot
param load good.yaml /else
param get /else
param load bad.yaml
param load keys.yaml
param load nothing.yaml
param load - /in <<< x: 1\\n
param get /in
param delete -v /a
param delete /a
param watch /robot | head -1
param list
""",
    "reconfigure": """\
reconfigure list
reconfigure list --json
reconfigure get /arm/robot
reconfigure get --json /arm/robot
reconfigure get /arm/robot gain
reconfigure get /arm/robot gian
reconfigure describe /arm/robot
reconfigure describe /arm/robot size
reconfigure describe --json /arm/robot gain
reconfigure set /arm/robot gain 2
reconfigure set /arm/robot gain 20
reconfigure set --json /arm/robot size large
reconfigure set /arm/robot '{steps: 7, label: new}'
reconfigure set /arm/robot steps many
reconfigure set /arm/robot '{steps: [1'
reconfigure set /arm/robot gian 2
reconfigure set_from_parameters /arm/robot _gain:=4
reconfigure dump /arm/robot -
reconfigure dump /arm/robot saved.yaml
reconfigure set /arm/robot gain 1
reconfigure load /arm/robot saved.yaml
reconfigure load --json /arm/robot saved.yaml
reconfigure load /arm/robot nothing.yaml
reconfigure load /arm/robot bad.yaml
reconfigure get /talker
reconfigure get /nobody
reconfigure watch /arm/robot | head -1
""",
}
"""Commands by the file of their output, among the nodes of the world."""
