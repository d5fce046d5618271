"""The operator's desk: a Textual screen over one printer."""

from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import ClassVar, Final, cast

from textual import events
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.screen import ModalScreen, Screen
from textual.widgets import Footer, Input, RichLog, Static

from cdhr_host.console import panels
from cdhr_host.console.entry import History, WordSuggester, history_file
from cdhr_host.console.help import HELP
from cdhr_host.console.jogging import AXES, SLIDERS, Jogging
from cdhr_host.console.terminal import Terminal
from cdhr_host.errors import CdhrError
from cdhr_host.job.surface import Event, JobState, Reply, Surface

REFRESH: Final = 0.1
"""s between two looks at the machine"""
OVERRIDE_STEP: Final = 0.1
MOVING: Final = frozenset({JobState.PRINTING, JobState.HOLDING, JobState.RESUMING, JobState.STOPPING})
FILE: Final = "file to print: "
CODE: Final = "G-code: "


class Keys(ModalScreen[None]):
    """What the keys do; any key closes it."""

    CSS = "Keys { align: center middle; } Keys Static { width: auto; border: solid; padding: 0 1; }"

    def compose(self) -> ComposeResult:
        """The table."""
        yield Static(HELP, markup=False)

    def on_key(self, event: events.Key) -> None:
        """Any key closes, and does nothing else."""
        event.stop()
        if self.is_current:  # a second key may be on its way already
            self.dismiss()


class Desk(App[None]):
    """Shows the machine and takes keys; everything goes through the printer's words."""

    ENABLE_COMMAND_PALETTE = False
    CSS = """
    Screen { layout: vertical; }
    #job { height: 2; text-style: bold; }
    #positions { height: 2; }
    #columns { height: 10; }
    #sliders { width: 40; }
    #cables { width: 1fr; }
    #air { height: 2; }
    #messages { height: 1fr; min-height: 2; border: none; padding: 0; }
    #typing { height: 1; }
    #prompt { width: auto; }
    #entry { width: 1fr; border: none; padding: 0; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        ("space", "hold_or_resume", "hold/resume"),
        ("f3", "ask_file", "file"),
        ("f5", "start", "start"),
        ("f8", "abort", "abort"),
        ("exclamation_mark", "emergency", "E-STOP"),
        ("question_mark", "help", "keys"),
        ("q", "leave", "quit"),
        Binding("ctrl+c", "hold", "hold", show=False, priority=True),
    ]

    def __init__(
        self,
        surface: Surface,
        *,
        history: Path | None = None,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        """Leaves, with the machine at rest, once ``should_stop`` says so."""
        super().__init__(driver_class=Terminal)
        self._should_stop = should_stop
        self._surface = surface
        self._history = History(history or history_file())
        self._jogging = Jogging(surface, self._answered)
        self._unlisten: Callable[[], None] = lambda: None
        self._leaving = False
        self._choosing = False
        self._prompt = ""

    def compose(self) -> ComposeResult:
        """The screen, from top to bottom: 80 x 24 hold it all."""
        yield Static(id="job", markup=False)
        yield Static(id="positions", markup=False)
        with Horizontal(id="columns"):
            yield Static(id="sliders", markup=False)
            yield Static(id="cables", markup=False)
        yield Static(id="air", markup=False)
        yield RichLog(id="messages", markup=False, wrap=True, max_lines=500)
        with Horizontal(id="typing"):
            yield Static(id="prompt", markup=False)
            yield Input(id="entry", compact=True, disabled=True, suggester=WordSuggester(self._history))
        yield Footer(compact=True)

    def on_mount(self) -> None:
        """Begin to look and to listen."""
        self._unlisten = self._surface.listen(self._heard)
        self.set_interval(REFRESH, self._refresh)
        self.query_one(RichLog).can_focus = False
        self._refresh()
        self.say("? shows what the keys do")

    def on_unmount(self) -> None:
        """Nobody looks any more."""
        self._unlisten()
        self._jogging.release()

    def on_app_blur(self) -> None:
        """The terminal lost the focus: no key of it is held any more."""
        self._jogging.release()

    async def on_event(self, event: events.Event) -> None:
        """Keys act in the order they were typed in, before any of them wanders through the widgets.

        What is typed fast after a prompt was opened must become text, never a command.
        """
        typed = isinstance(event, events.Key) and not event.is_forwarded and len(self.screen_stack) == 1
        if not (typed and self._pressed(cast("events.Key", event))):
            await super().on_event(event)

    def _pressed(self, event: events.Key) -> bool:
        """Whether this key was for the desk itself; typed text has the focus of its own."""
        if self._prompt:
            return self._typed_key(event.key)
        if self._choosing:
            self._choose(event.key)
            return True
        if event.key in AXES:
            self._try(lambda: self._jogging.press(event.key))
            return True
        act = self._small_keys().get(event.character or "") or self._named_keys().get(event.key)
        if act is not None:
            self._try(act)
        return act is not None

    def say(self, text: str) -> None:
        """Add to the messages."""
        for screen in self._own_screen():
            for log in screen.query(RichLog):
                log.write(text)

    def run_code(self, text: str) -> None:
        """Prove and run G-code; the answer becomes a message."""
        self._surface.run(text).add_done_callback(self._answered)

    def action_hold_or_resume(self) -> None:
        """The space bar."""
        held = self._surface.status().state is JobState.HELD
        self._try(self._surface.resume if held else lambda: self._surface.hold("operator"))

    def action_hold(self) -> None:
        """Ctrl-C: whatever moves comes to rest on its path."""
        self._try(lambda: self._surface.hold("operator"))

    def action_start(self) -> None:
        """Start the proven file."""
        self._try(self._surface.start)

    def action_abort(self) -> None:
        """Rest on the path, then lift."""
        self._try(lambda: self._surface.abort("operator"))

    def action_emergency(self) -> None:
        """Stop at once."""
        self._try(lambda: self._surface.emergency_stop("operator"))

    def action_help(self) -> None:
        """What the keys do."""
        self._jogging.release()
        self.push_screen(Keys())

    def action_ask_file(self) -> None:
        """Ask for a file to print."""
        self._open_entry(FILE)

    async def action_quit(self) -> None:
        """Textual's own key, Ctrl-Q."""
        self.action_leave()

    def action_leave(self) -> None:
        """Quit; while the machine moves only at the second time, after a hold."""
        if self._surface.status().state in MOVING and not self._leaving:
            self._leaving = True
            self._try(lambda: self._surface.hold("the console was left"))
            self.say("the print is held; q again leaves it so")
            return
        self._go()

    def _go(self) -> None:
        """Leave, and let go of every key."""
        self._jogging.release()
        self.exit()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """A line was typed."""
        text, prompt = event.value.strip(), self._prompt
        self._close_entry()
        if not text:
            return
        self.say(f"> {text}")
        if prompt == FILE:
            self._try(lambda: self._surface.load(Path(text).expanduser()))
        else:
            self._history.add(text)
            self.run_code(text)

    def _typed_key(self, key: str) -> bool:
        if key == "escape":
            self._close_entry()
        elif key in {"up", "down"} and self._prompt == CODE:
            entry = self.query_one(Input)
            entry.value = self._history.step(-1 if key == "up" else 1)
            entry.cursor_position = len(entry.value)
        else:
            return False
        return True

    def _small_keys(self) -> dict[str, Callable[[], None]]:
        """Character -> what it does."""
        return {
            " ": self.action_hold_or_resume,
            "!": self.action_emergency,
            "?": self.action_help,
            "q": self.action_leave,
            "+": lambda: self._jogging.resize(1),
            "-": lambda: self._jogging.resize(-1),
            "c": self._jogging.toggle,
            "s": self._ask_slider,
            ":": lambda: self._open_entry(CODE),
            "h": lambda: self.run_code("G28"),
            "[": lambda: self._override(feed=-OVERRIDE_STEP),
            "]": lambda: self._override(feed=OVERRIDE_STEP),
            "{": lambda: self._override(flow=-OVERRIDE_STEP),
            "}": lambda: self._override(flow=OVERRIDE_STEP),
            "0": lambda: self._surface.override(feed=1.0, flow=1.0),
        }

    def _named_keys(self) -> dict[str, Callable[[], None]]:
        """Name of a key without a character of its own -> what it does."""
        return {
            "escape": lambda: self._jogging.choose(None),
            "f3": self.action_ask_file,
            "f5": self.action_start,
            "f8": self.action_abort,
            "f9": self._surface.acknowledge,
            "f10": self.action_leave,
        }

    def _ask_slider(self) -> None:
        """The next key names a slider."""
        self._jogging.choose(None)
        self._choosing = True
        self.say("which slider alone? 1 to 6; any other key: none")

    def _choose(self, key: str) -> None:
        """A digit after ``s``."""
        self._choosing = False
        if key in SLIDERS:
            self._jogging.choose(SLIDERS.index(key))
            self.say(f"up, right: slider {key} pays out; down, left: takes in; Esc ends this")

    def _override(self, *, feed: float = 0.0, flow: float = 0.0) -> None:
        status = self._surface.status()
        if feed:
            self._surface.override(feed=round(status.feed_override + feed, 3))
        if flow:
            self._surface.override(flow=round(status.flow_override + flow, 3))

    def _open_entry(self, prompt: str) -> None:
        self._jogging.release()
        self._ask(prompt)
        self.screen.set_focus(self.query_one(Input))  # at once: the next key is text

    def _close_entry(self) -> None:
        self._ask("")

    def _ask(self, prompt: str) -> None:
        """Show a prompt and take text, or with an empty one take keys again."""
        self._prompt = prompt
        self.query_one("#prompt", Static).update(prompt)
        entry = self.query_one(Input)
        entry.value, entry.disabled = "", not prompt

    def _try(self, act: Callable[[], None]) -> None:
        """Do something the present state may refuse."""
        try:
            act()
        except CdhrError as error:
            for problem in error.problems:
                self.say(f"error: {problem.message}")
                if problem.hint:
                    self.say(f"hint: {problem.hint}")

    def _answered(self, future: "Future[Reply]") -> None:
        """From the printer's thread."""
        self.call_later(self._tell, future.result())

    def _tell(self, reply: Reply) -> None:
        for line in reply.lines:
            self.say(f"ok {line}" if reply.ok else line)

    def _heard(self, event: Event) -> None:
        """From the printer's thread."""
        if event.text:
            self.call_later(self.say, event.text)

    def _refresh(self) -> None:
        if self._should_stop():
            self._go()
            return
        status = self._surface.status()
        self._leaving = self._leaving and status.state in MOVING
        shown = {
            "job": panels.job(status),
            "positions": panels.positions(status),
            "sliders": panels.sliders(status, self._surface.profile),
            "cables": panels.cables(status),
            "air": f"{panels.air(status)}  {self._jogging.label}",
        }
        for screen in self._own_screen():
            for name, text in shown.items():
                for panel in screen.query(f"#{name}").results(Static):
                    panel.update(text)

    def _own_screen(self) -> list[Screen[object]]:
        """The desk itself, whatever covers it: none, or an empty one, once the program shuts down.

        The clock and the printer's thread go on for a moment after Textual has taken the screens away.
        """
        return self.screen_stack[:1]
