"""Serves the live page on this machine alone: files, and a WebSocket that sends frames and takes pause and speed."""

from __future__ import annotations

import asyncio
import json
import threading
from pathlib import Path
from typing import Any

from aiohttp import WSMsgType, web

from sim.grade import Grade
from sim.history import Snapshot
from sim.live.frames import frame, introduction, result
from sim.live.pace import SPEEDS, Pace
from sim.scenario import Scenario

STATIC = Path(__file__).parent / "static"
_HOST = "127.0.0.1"
_FRAME_PERIOD_S = 0.05
_PAST_PERIOD_S = 1.0
_HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-cache",
}


class LivePage:
    """An observer of a run; without a pace its viewers can only watch.

    `start` serves in a thread of its own, `observe` and `finish` may come from any other.
    """

    def __init__(self, scenario: Scenario, mcu: str, pace: Pace | None) -> None:
        self._pace = pace
        self._introduction = introduction(scenario, mcu, paced=pace is not None)
        self._sockets: set[web.WebSocketResponse] = set()
        self._past: list[dict[str, Any]] = []
        self._latest: dict[str, Any] | None = None
        self._events: list[dict[str, Any]] = []
        self._result: dict[str, Any] | None = None
        self._loop = asyncio.new_event_loop()
        self._thread: threading.Thread | None = None
        self._left = threading.Event()
        self._left.set()

    def observe(self, snapshot: Snapshot) -> None:
        """Takes a snapshot for the viewers."""
        self._post(frame(snapshot))

    def finish(self, grade: Grade) -> None:
        """Shows the result of the run."""
        if self._thread is not None:
            self._loop.call_soon_threadsafe(setattr, self, "_result", result(grade))

    @property
    def watched(self) -> bool:
        """Whether anybody looks at the page."""
        return not self._left.is_set()

    def start(self, port: int) -> str:
        """Serves on this port, or on a free one when it is taken; returns the address of the page."""
        ready: asyncio.Future[str] = self._loop.create_future()
        self._thread = threading.Thread(target=self._serve, args=(port, ready), name="live page", daemon=True)
        started = threading.Event()
        ready.add_done_callback(lambda _: started.set())
        self._thread.start()
        started.wait()
        return ready.result()

    def stay(self) -> None:
        """Returns when the last viewer has left; at once when nobody watches."""
        while not self._left.wait(0.2):
            pass

    def close(self) -> None:
        """Ends the service."""
        if self._thread is not None:
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()
            self._thread = None

    def application(self) -> web.Application:
        """The page as an aiohttp application."""
        app = web.Application(middlewares=[_guard])
        app.router.add_get("/", _index)
        app.router.add_get("/live", self._socket)
        app.router.add_static("/", STATIC)
        app.cleanup_ctx.append(self._pump)
        return app

    def _post(self, message: dict[str, Any]) -> None:
        if self._thread is not None:
            self._loop.call_soon_threadsafe(self._take, message)

    # In the thread of the page: keeps what late viewers need to draw the past.
    def _take(self, message: dict[str, Any]) -> None:
        self._events += message["events"]
        self._latest = message
        if not self._past or message["t"] >= self._past[-1]["t"] + _PAST_PERIOD_S:
            self._past.append({**message, "events": []})

    def _serve(self, port: int, ready: asyncio.Future[str]) -> None:
        asyncio.set_event_loop(self._loop)

        async def begin() -> web.AppRunner:
            runner = web.AppRunner(self.application(), access_log=None)
            await runner.setup()
            try:
                site = web.TCPSite(runner, _HOST, port)
                await site.start()
            except OSError:
                site = web.TCPSite(runner, _HOST, 0)
                await site.start()
            address = runner.addresses[0]
            ready.set_result(f"http://{address[0]}:{address[1]}/")
            return runner

        runner = self._loop.run_until_complete(begin())
        self._loop.run_forever()
        self._loop.run_until_complete(runner.cleanup())
        self._loop.close()

    # Sends the latest frame to all viewers at a rate that the eye can follow, however fast the run goes.
    async def _pump(self, _: web.Application) -> Any:
        task = asyncio.get_running_loop().create_task(self._send_frames())
        yield
        task.cancel()
        for socket in list(self._sockets):
            await socket.close()

    async def _send_frames(self) -> None:
        sent, events, told = None, 0, False
        while True:
            await asyncio.sleep(_FRAME_PERIOD_S)
            state = {"paused": self._pace.paused, "speed": self._pace.speed} if self._pace else {}
            if self._latest is not None and (sent is not self._latest or state != self._state_sent):
                sent, self._state_sent = self._latest, state
                await self._broadcast({**sent, **state, "events": self._events[events:]})
                events = len(self._events)
            if self._result is not None and not told:
                told = True
                await self._broadcast(self._result)

    _state_sent: dict[str, Any] | None = None

    async def _broadcast(self, message: dict[str, Any]) -> None:
        text = _dump(message)
        for socket in list(self._sockets):
            try:
                await asyncio.wait_for(socket.send_str(text), 2.0)
            except (TimeoutError, ConnectionError, RuntimeError):
                self._leave(socket)

    async def _socket(self, request: web.Request) -> web.WebSocketResponse:
        socket = web.WebSocketResponse(heartbeat=20.0, max_msg_size=4096)
        await socket.prepare(request)
        await socket.send_str(_dump(self._introduction))
        await socket.send_str(_dump({"type": "past", "frames": self._past, "events": self._events}))
        if self._result is not None:
            await socket.send_str(_dump(self._result))
        self._sockets.add(socket)
        self._left.clear()
        self._state_sent = None
        try:
            async for message in socket:
                if message.type is WSMsgType.TEXT:
                    self._command(message.data)
        finally:
            self._leave(socket)
        return socket

    def _leave(self, socket: web.WebSocketResponse) -> None:
        self._sockets.discard(socket)
        if not self._sockets:
            self._left.set()

    # Takes {"paused": bool} and {"speed": 1 | 4 | 8 | null}; anything else has no effect.
    def _command(self, text: str) -> None:
        try:
            command = json.loads(text)
        except (ValueError, RecursionError):
            return
        if not isinstance(command, dict) or self._pace is None:
            return
        if isinstance(command.get("paused"), bool):
            self._pace.set(paused=command["paused"])
        speed = command.get("speed", False)
        if speed is None or (type(speed) in (int, float) and speed in SPEEDS):
            self._pace.set(speed=speed)


# Refuses requests that another site's page sends by way of this machine's browser.
@web.middleware
async def _guard(request: web.Request, handler: Any) -> web.StreamResponse:
    host = request.host.rsplit(":", 1)[0]
    origin = request.headers.get("Origin")
    if host not in (_HOST, "localhost") or origin not in (None, f"http://{request.host}"):
        raise web.HTTPForbidden(text="this page is served to this machine alone\n")
    response: web.StreamResponse = await handler(request)
    if not response.prepared:
        response.headers.update(_HEADERS)
    return response


async def _index(_: web.Request) -> web.FileResponse:
    return web.FileResponse(STATIC / "index.html")


def _dump(message: dict[str, Any]) -> str:
    return json.dumps(message, separators=(",", ":"), allow_nan=False)
