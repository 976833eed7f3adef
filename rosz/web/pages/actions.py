"""All actions, a form that sends a goal, and the goals with their feedback."""

from __future__ import annotations

import time
from typing import Any

from nicegui import ui

from rosz.web.model import ActionRow, Actions, ActionUse, GoalRow, SentGoal, System
from rosz.web.pages import layout
from rosz.web.pages.form import MessageForm

_LIST_PERIOD = 1.0
_PERIOD = 0.25
_MOST_SHOWN = 10
_COLORS = {"succeeded": "positive", "aborted": "negative", "rejected": "negative",
           "lost": "negative", "canceled": "warning", "preempted": "warning",
           "recalled": "warning"}  # fmt: skip


class ActionsPage:
    """The list of actions, the form for one that the address may name, and the goals."""

    def __init__(self, system: System, action: str = "") -> None:
        self._system = system
        self._actions: Actions = system.actions
        self._frame = frame = layout.Frame(system, "Actions", "/actions")
        self._graph = frame.use(system.graph)
        self._rows: dict[str, ActionRow] = {}
        self._wanted = action
        self._chosen = ""
        self._use: layout.Opened[ActionUse] = layout.Opened(frame)  # goals go on
        self._cards: dict[SentGoal, _GoalCard] = {}
        with frame.content:
            self._empty = layout.empty_state(
                "flag",
                "No action",
                "Nodes that serve actions appear here; a small one is in:",
                "rosz help actions",
            )
            with ui.element("div").classes("w-full grid gap-4 grid-cols-1 lg:grid-cols-2"):
                with ui.column().classes("gap-4 min-w-0"):
                    self._table = self._add_table()
                    self._others = _OtherGoals(self._cancel)
                with ui.column().classes("gap-4 min-w-0"):
                    self._add_form()
                    self._goals = ui.column().classes("w-full gap-3")
        frame.every(_LIST_PERIOD, self._list)
        frame.every(_PERIOD, self._refresh)

    def _add_table(self) -> ui.table:
        columns = [
            layout.column("name", "Action"),
            layout.column("type", "Type", "rosz-soft"),
            layout.column("servers", "Node", "rosz-wide"),
        ]
        with layout.card("Actions"):
            table = layout.add_table(columns)
            layout.offer_choice(table, self._choose)
        return table

    def _add_form(self) -> None:
        with ui.column().classes("rosz-card p-4 gap-2 min-w-0 w-full"):
            self._name = ui.label("Choose an action.").classes("text-base font-semibold break-all")
            self._type = ui.label("").classes("rosz-soft")
            self._form = MessageForm(
                self._system.node, "Goal in YAML; fields left out have their default value"
            )
            with ui.row().classes("w-full items-center gap-3"):
                self._send_button = ui.button("Send goal", icon="send", on_click=self._send)
                self._send_button.disable()
                self._cancel_button = ui.button(
                    "Cancel all", icon="cancel", on_click=lambda: self._cancel("")
                )
                self._cancel_button.props("outline").disable()
                with self._cancel_button:
                    ui.tooltip("Ends the goals of all clients")

    def _list(self) -> None:
        served = self._actions.rows(self._graph.survey().view)
        self._rows = {row.name: row for row in served}
        rows = [
            {
                "name": row.name,
                "address": layout.query_of("/actions", action=row.name),
                "type": row.type,
                "servers": ", ".join(row.servers),
            }
            for row in served
        ]
        layout.show_rows(self._table, rows)
        if self._wanted in self._rows:
            wanted, self._wanted = self._wanted, ""
            ui.timer(0, lambda: self._choose(wanted), once=True)
        elif self._wanted and self._graph.complete:
            self._type.set_text(f"Waiting for a server of '{self._wanted}'.")
        self._empty.set_visibility(not rows and self._graph.complete)

    async def _choose(self, name: str) -> None:
        self._use.close()
        row = self._rows.get(name)
        self._chosen = name
        self._name.set_text(name)
        self._type.set_text(f"{row.type} · {row.protocol}" if row else "")
        self._form.clear()
        for button in (self._send_button, self._cancel_button):
            button.disable()
        layout.address_of(layout.query_of("/actions", action=name))
        view = self._graph.survey().view
        use = await self._frame.attempt(lambda: self._actions.use(view, name))
        if use is None:
            return
        if self._chosen != name or self._frame.closed:
            use.close()
            return
        self._use.set(use)
        self._form.show(use.value.goal_type)
        for button in (self._send_button, self._cancel_button):
            button.enable()

    async def _send(self) -> None:
        name, text, view = self._chosen, self._form.text, self._graph.survey().view
        self._send_button.disable()
        await self._frame.attempt(lambda: self._actions.send(view, name, text))
        self._send_button.enable()
        self._refresh()

    async def _cancel(self, goal_id: str) -> None:
        name, view = self._chosen, self._graph.survey().view
        answer = await self._frame.attempt(lambda: self._actions.cancel(view, name, goal_id))
        if answer is not None:
            ui.notify(answer, type="info")

    def _refresh(self) -> None:
        goals = self._actions.goals(self._chosen)[:_MOST_SHOWN] if self._chosen else []
        for gone in set(self._cards) - set(goals):
            self._cards.pop(gone).delete()
        for goal in reversed(goals):
            if goal not in self._cards:
                with self._goals:
                    self._cards[goal] = _GoalCard(goal, self._cancel)
            self._cards[goal].refresh()
        own = {goal.id for goal in goals}
        use = self._use.value
        rows = [] if use is None else use.value.rows()
        self._others.show([row for row in rows if row.id not in own])


class _GoalCard:
    """One goal that a page has sent."""

    def __init__(self, goal: SentGoal, cancel: Any) -> None:
        self._goal = goal
        self._seen = -1
        self._ended = False
        self._card = ui.column().classes("rosz-card w-full p-4 gap-2 min-w-0")
        self._card.move(target_index=0)
        with self._card:
            with ui.row().classes("w-full items-center gap-3 no-wrap"):
                self._state = ui.badge(goal.state, color="info").classes("text-sm")
                self._time = ui.label("").classes("rosz-soft rosz-number text-sm")
                ui.space()
                self._cancel = ui.button("Cancel", on_click=lambda: cancel(goal.id))
                self._cancel.props("flat dense")
            ui.label(f"{time.strftime('%H:%M:%S', time.localtime(goal.began))}  {goal.id}").classes(
                "rosz-mono rosz-soft break-all"
            )
            self._result = ui.label("").classes("rosz-mono whitespace-pre-wrap break-all w-full")
            self._fault = ui.label("").classes("text-negative break-words w-full")
            self._count = ui.label("").classes("text-sm font-medium")
            self._feedback = ui.label("").classes(
                "rosz-mono whitespace-pre-wrap break-all w-full overflow-auto max-h-40"
            )
            with ui.expansion("Earlier feedback").props("dense").classes("w-full") as self._more:
                self._earlier = ui.label("").classes(
                    "rosz-mono whitespace-pre-wrap break-all w-full overflow-auto max-h-60"
                )

    def delete(self) -> None:
        """Remove it from the page."""
        self._card.delete()

    def refresh(self) -> None:
        """Show the changes."""
        goal = self._goal
        if self._ended and self._seen == goal.feedbacks:
            return
        self._ended = goal.done
        self._state.set_text(goal.state)
        self._state.props(f"color={_COLORS.get(goal.state, 'info')}")
        self._time.set_text(f"{goal.seconds:.1f} s")
        self._cancel.set_visibility(not goal.done)
        layout.show_text(self._result, goal.result)
        layout.show_text(self._fault, goal.fault)
        if self._seen != goal.feedbacks:
            self._seen = goal.feedbacks
            texts = goal.feedback()
            self._count.set_text(f"Feedback {goal.feedbacks}")
            self._feedback.set_text(texts[0][1] if texts else "")
            self._earlier.set_text("\n".join(f"{number}\n{text}" for number, text in texts[1:]))
        for part in (self._count, self._feedback):
            part.set_visibility(self._seen > 0)
        self._more.set_visibility(self._seen > 1)


class _OtherGoals:
    """The goals of others, as the server publishes them."""

    def __init__(self, cancel: Any) -> None:
        self._cancel = cancel
        self._shown: list[GoalRow] = []
        with layout.card("Other goals of the server") as self._card:
            self._rows = ui.column().classes("w-full gap-1")
        self._card.set_visibility(False)

    def show(self, rows: list[GoalRow]) -> None:
        """Show goals, the newest first."""
        rows = rows[:_MOST_SHOWN]
        if rows == self._shown:
            return
        self._shown = rows
        self._card.set_visibility(bool(rows))
        self._rows.clear()
        with self._rows:
            for row in rows:
                self._add(row)

    def _add(self, row: GoalRow) -> None:
        with ui.row().classes("w-full items-center gap-3 no-wrap"):
            ui.badge(row.state, color=_COLORS.get(row.state, "info"))
            ui.label(row.id).classes("rosz-mono rosz-soft break-all grow")
            if row.running:
                ui.button("Cancel", on_click=lambda: self._cancel(row.id)).props("flat dense")
