"""``dynamic_reconfigure.encoding``: dictionaries of parameters as messages, and back."""

from __future__ import annotations

from rosz.reconfigure import Config
from rosz.reconfigure.messages import (
    decode_config,
    decode_description,
    encode_config,
    encode_description,
    encode_groups,
    extract_params,
    get_tree,
    group_dict,
    in_groups,
    initial_config,
)

__all__ = (
    "Config",
    "decode_config",
    "decode_description",
    "encode_config",
    "encode_description",
    "encode_groups",
    "extract_params",
    "get_tree",
    "group_dict",
    "in_groups",
    "initial_config",
)
