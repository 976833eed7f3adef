#!/usr/bin/env python
"""Messages and services of a package of one's own."""

import threading

import rospy
from wildlife import msg as types
from wildlife.msg import Animal, Herd
from wildlife.srv import Count, CountRequest, CountResponse

print(Animal())
print(Herd(animals=[Animal(name="emu", legs=2)], corners=[1, 2]))
print(Animal.FAST, Animal.SLOW, repr(Animal.MOTTO), types.Animal is Animal)
print(Animal._type, Animal._md5sum, Animal.__slots__, Animal._slot_types)
print(Herd._type, Herd._md5sum, Herd._slot_types, Herd._has_header)
print(Count._type, Count._md5sum, CountRequest.__slots__, CountResponse.__slots__)
print(CountRequest(legs=2), CountResponse.ENOUGH)
for make in (lambda: Animal(wings=2), lambda: Herd(1, 2, 3, 4, 5, 6, 7, 8)):
    try:
        print(make())
    except (AttributeError, TypeError):
        print("refused")

rospy.init_node("ranger")
herd = []
done = threading.Event()


def seen(message):
    herd.extend(message.animals)
    print(message)
    done.set()


def count(request):
    return sum(animal.legs == request.legs for animal in herd), herd[:1]


rospy.Service("count", Count, count)
rospy.Subscriber("herd", Herd, seen)
publisher = rospy.Publisher("herd", Herd, queue_size=1)
while publisher.get_num_connections() < 1:
    rospy.sleep(0.01)
print(rospy.ServiceProxy("count", Count)(4))
message = Herd()
message.header.frame_id = "savanna"
message.header.stamp = rospy.Time(100)
message.animals = [Animal(name="emu", legs=2, speed=Animal.FAST), Animal(name="cow", legs=4)]
message.corners = (0.5, 1.5)
message.since = rospy.Time(1, 2)
message.rest = rospy.Duration(-0.5)
message.tags = [b"a"[0], 2]
publisher.publish(message)
done.wait(60)
for bad in (Herd(corners=[1]), Herd(tags=[300])):
    try:
        publisher.publish(bad)
        print("fine")
    except rospy.ROSException as error:
        print(type(error).__name__)
