#!/usr/bin/env python3
"""Publish a sine wave whose amplitude and frequency others change while the node runs."""

import math
from collections.abc import Mapping

import rosz
from rosz.msgs.std_msgs.msg import Float64
from rosz.reconfigure import Config, Description, Server, Setting

RATE = 20.0

SETTINGS = Description(
    [
        Setting("amplitude", 1.0, "Height of the wave", min=0.0, max=10.0),
        Setting("frequency", 0.5, "Waves per second", min=0.1, max=5.0),
        Setting("enabled", True, "Whether anything is published"),
    ]
)

with rosz.Node("wave") as node:

    def on_change(config: Config, _levels: int) -> Mapping[str, object]:
        """Accept all changes; the first call has the values from the parameter store."""
        node.log.info("amplitude %.1f, frequency %.1f Hz", config.amplitude, config.frequency)
        return config

    wave = node.publisher("wave", Float64, queue_size=10)
    server = Server(node, SETTINGS, on_change)
    phase = 0.0
    for _ in node.rate(RATE):
        config = server.config
        phase += 2 * math.pi * config.frequency / RATE
        if config.enabled:
            wave.publish(Float64(data=config.amplitude * math.sin(phase)))
