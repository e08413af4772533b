"""Hands received messages to listeners from a thread that no bus error and no listener can end."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable

from companion.link.bus import Bus, BusState
from companion.link.message import Message

_POLL_S = 0.2


class Listener(ABC):
    """Somebody who wants to know of every received message; called from the notifier's thread."""

    @abstractmethod
    def on_message(self, message: Message) -> None:
        """Takes one message."""

    def on_error(self, error: Exception) -> None:  # noqa: B027 (need not be heard)
        """Hears that this listener itself, or the bus, failed."""

    def stop(self) -> None:  # noqa: B027 (need not be heard)
        """Hears that no more messages come."""


class BufferedReader(Listener):
    """Keeps messages until they are asked for; the oldest go first when nobody asks for too long."""

    def __init__(self, capacity: int = 4096) -> None:
        self._messages: deque[Message] = deque(maxlen=capacity)
        self.errors: deque[str] = deque(maxlen=16)

    def on_message(self, message: Message) -> None:
        """Keeps it."""
        self._messages.append(message)

    def on_error(self, error: Exception) -> None:
        """Notes it."""
        self.errors.append(f"{type(error).__name__}: {error}")

    def take(self) -> list[Message]:
        """All messages since the last call."""
        return [self._messages.popleft() for _ in range(len(self._messages))]


class Notifier:
    """Reads a bus in a thread of its own until `stop` or until the bus is shut."""

    def __init__(self, bus: Bus, listeners: Iterable[Listener]) -> None:
        self.errors = 0
        self._bus = bus
        self._listeners = list(listeners)
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="notifier", daemon=True)
        self._thread.start()

    def add_listener(self, listener: Listener) -> None:
        """Adds a listener to those told from now on."""
        self._listeners = [*self._listeners, listener]

    def stop(self, timeout: float = 2.0) -> None:
        """Ends the thread and tells the listeners."""
        self._stopping.set()
        self._thread.join(timeout)
        for listener in self._listeners:
            listener.stop()

    def is_alive(self) -> bool:
        """Whether the thread still reads."""
        return self._thread.is_alive()

    def _run(self) -> None:
        while not self._stopping.is_set() and self._bus.state is not BusState.SHUT:
            try:
                message = self._bus.recv(_POLL_S)
            except Exception as error:
                self._failed(error, self._listeners)
                self._stopping.wait(_POLL_S)
                continue
            for listener in self._listeners if message is not None else ():
                try:
                    listener.on_message(message)  # type: ignore[arg-type]
                except Exception as error:
                    self._failed(error, [listener])

    def _failed(self, error: Exception, listeners: list[Listener]) -> None:
        self.errors += 1
        for listener in listeners:
            try:
                listener.on_error(error)
            except Exception:
                self.errors += 1
