"""Inspect a running system, as the commands do: list, measure, send and query.

``connect`` opens the session of a command, and ``survey`` takes a snapshot of the network;
``topics``, ``services``, ``nodes``, ``parameters`` and ``definitions`` list and describe a system,
as ROS 1's tools do. ``subscribe``, ``fields``, ``echo``, ``measure`` and ``rosout`` follow topics;
``arguments`` and ``publish`` send messages that are written as YAML. The names are imported on
first use, since a command has to start fast.
"""

from __future__ import annotations

from rosz.lazy import exports_of

TYPE_CHECKING = False  # typing takes longer to import than everything else here
if TYPE_CHECKING:
    from rosz.introspect.arguments import (
        list_arguments,
        listing_arguments,
        make_message,
        read_arguments,
        read_file,
        read_stream,
    )
    from rosz.introspect.connect import command_config, find_unreached, open_context, open_session
    from rosz.introspect.definitions import Definitions
    from rosz.introspect.echo import (
        Echo,
        EchoOptions,
        dump_bytes,
        plot_columns,
        plot_values,
        shorten,
    )
    from rosz.introspect.fields import FieldPath, Filter, FilterFailed, Loader, Target, find_target
    from rosz.introspect.measure import (
        BandwidthMeter,
        BandwidthStats,
        DelayMeter,
        DelayStats,
        RateMeter,
        format_bandwidth,
        format_delay,
        format_rate,
        format_rates,
        rate_table,
        read_stamp,
    )
    from rosz.introspect.nodes import (
        PING_TIMEOUT,
        NodeEntry,
        find_nodes,
        format_connections,
        format_node,
        get_info,
        get_levels,
        kill,
        kill_nodes,
        list_nodes,
        machines,
        nodes_on_machine,
        ping,
        set_level,
    )
    from rosz.introspect.parameters import ParameterTree
    from rosz.introspect.publish import DEFAULT_RATE, ONCE_SECONDS, Sender, SendOptions
    from rosz.introspect.rosout import (
        GATHERED,
        LOGS,
        LogFilter,
        LogLine,
        format_line,
        is_log,
        read_line,
        to_ros1_log,
        to_ros2_log,
    )
    from rosz.introspect.services import (
        call_service,
        find_server,
        list_services,
        service_key,
        services_of_type,
        wait_for_server,
    )
    from rosz.introspect.subscribe import (
        find_class,
        find_token,
        resolve_field,
        subscribe_samples,
        topic_types,
        wait_for_target,
    )
    from rosz.introspect.survey import Survey, process_address, take_survey
    from rosz.introspect.topics import (
        Topic,
        by_host,
        entity_row,
        find_topic,
        format_topic,
        format_topics,
        in_namespace,
        list_topics,
        topics_of_type,
    )
else:
    __getattr__ = exports_of(__name__)
