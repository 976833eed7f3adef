"""A form made of a message type: its fields, and the same as YAML, each following the other."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import ui
from nicegui.elements.mixins.value_element import ValueElement

from rosz.node import Node
from rosz.web.model import Form, FormField
from rosz.web.pages import layout

_FEW = 12
"""Number of fields up to which a form shows all of them at once."""


class MessageForm:
    """The form of one message, which is empty until it has a type; the node knows the time."""

    def __init__(self, node: Node, label: str) -> None:
        self._node = node
        self._form: Form | None = None
        self._editors: list[tuple[FormField, ValueElement[Any]]] = []
        self._own = False
        self._box = ui.column().classes("w-full gap-0 min-w-0")
        self._text = (
            ui.textarea(label, on_change=lambda event: self._write(event.value or ""))
            .props("outlined autogrow stack-label input-class=rosz-mono spellcheck=false")
            .classes("w-full")
        )
        self._fault = ui.label("").classes("text-negative text-sm break-words w-full")
        self._fault.props("role=alert").set_visibility(False)

    @property
    def text(self) -> str:
        """The message as YAML; fields that are left out have their default value."""
        return self._text.value or ""

    def clear(self) -> None:
        """Show no fields and no text."""
        self._form = None
        self._editors.clear()
        self._box.clear()
        self._set_text("")
        layout.show_text(self._fault, "")

    def show(self, cls: type[Any]) -> None:
        """Show the fields of a message class with their default values."""
        self.clear()
        self._form = form = Form(cls)
        with self._box:
            if not form.fields:
                ui.label("It has no fields.").classes("rosz-soft")
            self._add(form.fields, opened=sum(field.size for field in form.fields) <= _FEW)
        self._set_text(form.text)

    def _add(self, fields: tuple[FormField, ...], *, opened: bool) -> None:
        for field in fields:
            if field.kind == "message":
                self._add_group(field, opened=opened or len(fields) == 1)
            else:
                self._add_field(field)

    def _add_group(self, field: FormField, *, opened: bool) -> None:
        group = (
            ui.expansion(field.name, caption=field.type, value=opened)
            .props("dense dense-toggle header-class=rosz-group")
            .classes("w-full")
        )
        built = False

        def build() -> None:
            nonlocal built
            if built or not group.value:
                return
            built = True  # a part that is never opened costs nothing
            with group, ui.column().classes("w-full gap-0 rosz-indent"):
                self._add(field.fields, opened=opened)

        group.on_value_change(build)
        build()

    def _add_field(self, field: FormField) -> None:
        with ui.row().classes("w-full items-center gap-x-3 gap-y-0 py-1 no-wrap"):
            with ui.column().classes("gap-0 w-32 sm:w-40 shrink-0"):
                ui.label(field.name).classes("font-medium break-all leading-tight")
                ui.label(field.type).classes("rosz-soft text-xs break-all leading-tight")
            editor = self._editor(field)
            editor.props(f'aria-label="{".".join(field.path)}"')
            if field.hint:
                with editor:
                    ui.tooltip(field.hint)
        self._editors.append((field, editor))

    def _editor(self, field: FormField) -> ValueElement[Any]:
        form = self._form
        value = None if form is None else form.value(field)

        def change(event: Any) -> None:
            self._change(field, event.value)

        editor: ValueElement[Any]
        if field.kind == "bool":
            return ui.switch(value=bool(value), on_change=change)
        if field.kind == "choice":
            editor = ui.select(_options(field, value), value=value, on_change=change)
        elif field.kind in ("integer", "number"):
            editor = ui.number(value=value, min=field.low, max=field.high, on_change=change)
            editor.props("step=any" if field.kind == "number" else "")
        else:
            editor = ui.input(value=str(value), on_change=change)
            editor.props("input-class=rosz-mono" if field.kind == "yaml" else "")
        return editor.classes("grow min-w-0")

    # From the fields to the text, and back.

    def _change(self, field: FormField, value: Any) -> None:
        if self._own or self._form is None or value is None:
            return
        fault = self._form.change(field, value, self._node.now())
        layout.show_text(self._fault, fault)
        if not fault:
            self._set_text(self._form.text)

    def _write(self, text: str) -> None:
        if self._own or self._form is None:
            return
        self._form.write(text, self._node.now())
        layout.show_text(self._fault, self._form.fault)
        if not self._form.fault:
            self._quietly(self._show_values)

    def _show_values(self) -> None:
        form = self._form
        for field, editor in self._editors:
            value = None if form is None else form.value(field)
            if isinstance(editor, ui.select):
                editor.set_options(_options(field, value), value=value)
            elif editor.value != value:
                editor.set_value(value)

    def _set_text(self, text: str) -> None:
        self._quietly(lambda: self._text.set_value(text))

    def _quietly(self, action: Callable[[], object]) -> None:
        """Change the shown value without reporting it as the user's change."""
        self._own = True
        try:
            action()
        finally:
            self._own = False


def _options(field: FormField, value: Any) -> dict[Any, str]:
    """Return the names of values, with one for a value that has none."""
    named = {choice: f"{name} ({choice})" for choice, name in field.choices.items()}
    return named if value in named else {value: str(value), **named}
