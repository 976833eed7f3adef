"""smach_ros.action_server_wrapper: an action whose goals a container executes."""

from __future__ import annotations

import traceback
from collections.abc import Iterable, Mapping
from copy import copy
from typing import Any

from rosz.ros1.client import rospy
from rosz.ros1.client.actionlib import SimpleActionServer
from rosz.ros1.libraries.smach import Container, InvalidUserCodeError, Remapper, UserData


class ActionServerWrapper:
    """An action server that executes a container for each goal.

    Args:
        server_name: Name of the action.
        action_spec: Class of the action.
        wrapped_container: The container.
        succeeded_outcomes: Its outcomes that mean success.
        aborted_outcomes: Its outcomes that mean failure, as do all that are not named.
        preempted_outcomes: Its outcomes that mean preemption.
        goal_key: Key for the goal in the user data.
        feedback_key: Key of feedback, which is published at each transition.
        result_key: Key of the result.
        goal_slots_map: For fields of the goal, keys to copy them to.
        feedback_slots_map: Not used, as in ROS 1.
        result_slots_map: For fields of the result, keys to copy them from.
        expand_goal_slots: Whether to copy each field of the goal to a key of its name.
        pack_result_slots: Whether to copy each field of the result from a key of its name.

    Attributes:
        wrapped_container: The container.
        userdata: User data of the server.
    """

    def __init__(  # noqa: PLR0917  # smach's
        self,
        server_name: str,
        action_spec: Any,
        wrapped_container: Container,
        succeeded_outcomes: Iterable[str] = (),
        aborted_outcomes: Iterable[str] = (),
        preempted_outcomes: Iterable[str] = (),
        goal_key: str = "action_goal",
        feedback_key: str = "action_feedback",
        result_key: str = "action_result",
        goal_slots_map: Mapping[str, str] | None = None,
        feedback_slots_map: Mapping[str, str] | None = None,  # noqa: ARG002  # smach's
        result_slots_map: Mapping[str, str] | None = None,
        expand_goal_slots: bool = False,
        pack_result_slots: bool = False,
    ) -> None:
        self.wrapped_container: Container = wrapped_container
        wrapped_container.register_transition_cb(self.transition_cb)
        wrapped_container.register_termination_cb(self.termination_cb)
        self._goal_key, self._feedback_key, self._result_key = goal_key, feedback_key, result_key
        self._goal_slots_map = goal_slots_map or {}
        self._result_slots_map = result_slots_map or {}
        self._expand_goal_slots, self._pack_result_slots = expand_goal_slots, pack_result_slots
        whole = action_spec()
        self.userdata: UserData = UserData()
        self.userdata[goal_key] = copy(whole.action_goal.goal)
        self.userdata[result_key] = copy(whole.action_result.result)
        self.userdata[feedback_key] = copy(whole.action_feedback.feedback)
        self._server_name, self._action_spec = server_name, action_spec
        self._succeeded_outcomes = set(succeeded_outcomes)
        self._preempted_outcomes = set(preempted_outcomes)
        succeeded, preempted = self._succeeded_outcomes, self._preempted_outcomes
        aborted = set(aborted_outcomes)
        twice = (succeeded & aborted) | (succeeded & preempted) | (aborted & preempted)
        if twice:
            rospy.logerr(f"action '{server_name}': outcomes mean two things: {sorted(twice)}")
        self._action_server = SimpleActionServer(
            server_name, action_spec, execute_cb=self.execute_cb, auto_start=False
        )

    def run_server(self) -> None:
        """Start the action server; this does not block."""
        self._action_server.register_preempt_callback(self.preempt_cb)
        self._action_server.start()
        rospy.loginfo(f"Started SMACH action server wrapper, advertising as '{self._server_name}'")

    def transition_cb(self, userdata: Any, active_states: Any) -> None:  # noqa: ARG002
        """Publish feedback; the container calls this at each transition."""
        self.publish_feedback(userdata)

    def termination_cb(self, userdata: Any, terminal_states: Any, container_outcome: Any) -> None:  # noqa: ARG002
        """Log the outcome; the container calls this when it has ended."""
        rospy.logdebug(f"wrapped container ended in {terminal_states} with '{container_outcome}'")

    def publish_feedback(self, userdata: Any) -> None:
        """Publish the feedback of user data, if there is any."""
        if self._feedback_key in userdata:
            self._action_server.publish_feedback(userdata[self._feedback_key])

    def execute_cb(self, goal: Any) -> None:
        """Execute the container for a goal; the action server calls this."""
        ud, container = self.userdata, self.wrapped_container
        if self._expand_goal_slots:
            for slot in goal.__slots__:
                ud[slot] = getattr(goal, slot)
        ud[self._goal_key] = goal
        for slot, key in self._goal_slots_map.items():
            ud[key] = getattr(goal, slot)
        seen = Remapper(
            ud, container.get_registered_input_keys(), container.get_registered_output_keys()
        )
        try:
            outcome = container.execute(seen)
        except InvalidUserCodeError:
            rospy.logerr("Exception thrown while executing wrapped container.")
            self._action_server.set_aborted()
            return
        except Exception:  # noqa: BLE001  # the callback boundary
            text = traceback.format_exc()
            rospy.logerr(f"Exception thrown while executing wrapped container: {text}")
            self._action_server.set_aborted()
            return
        self._finish(outcome)

    def _finish(self, outcome: Any) -> None:
        ud, server = self.userdata, self._action_server
        result = ud[self._result_key]
        for slot, key in self._result_slots_map.items():
            setattr(result, slot, ud[key])
        if self._pack_result_slots:
            for slot in result.__slots__:
                if slot in ud:
                    setattr(result, slot, ud[slot])
        if outcome in self._succeeded_outcomes:
            rospy.loginfo("SUCCEEDED")
            server.set_succeeded(result)
        elif outcome in self._preempted_outcomes:
            rospy.loginfo("PREEMPTED")
            server.set_preempted(result)
        else:
            rospy.loginfo("ABORTED")
            server.set_aborted(result)

    def preempt_cb(self) -> None:
        """Preempt the container; the action server calls this when a goal is cancelled."""
        rospy.loginfo("Preempt on state machine requested!")
        self.wrapped_container.request_preempt()
