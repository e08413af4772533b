"""The live page is served to this machine alone, tells viewers what they need, and obeys them in pace only."""

import asyncio
import json
import time
from typing import Any

import pytest
from aiohttp import ClientSession, WSMsgType

from sim.grade import grade
from sim.history import stack
from sim.live import LivePage, Pace
from sim.live.server import STATIC
from sim.scenario import CriteriaConfig, load_scenario
from tests.sim.synthetic import START_S, fleet_swims


def strict(text: str) -> Any:
    """JSON as browsers take it: no NaN and no Infinity."""

    def refuse(constant: str) -> None:
        pytest.fail(f"{constant} in a frame")

    return json.loads(text, parse_constant=refuse)


def serve(page: LivePage, visit: Any) -> Any:
    url = page.start(0)
    try:
        return asyncio.run(asyncio.wait_for(visit(url), 20.0))
    finally:
        page.close()


def test_every_file_of_the_page_is_served_without_the_internet() -> None:
    async def visit(url: str) -> None:
        async with ClientSession() as session:
            for path in ["", *(file.name for file in STATIC.iterdir())]:
                async with session.get(url + path) as response:
                    assert response.status == 200, path
                    assert "default-src 'self'" in response.headers["Content-Security-Policy"]
                    text = await response.text()
                    assert "https://" not in text
                    assert "http://" not in text.replace("http://www.w3.org", "")
            async with session.get(url + "../server.py") as response:
                assert response.status == 404

    assert sum(file.stat().st_size for file in STATIC.iterdir()) < 200_000
    serve(LivePage(load_scenario("demo"), "native", Pace(None)), visit)


def test_a_viewer_gets_past_present_and_result() -> None:
    page = LivePage(load_scenario("demo"), "native", Pace(None))
    snapshots = fleet_swims()

    async def visit(url: str) -> list[Any]:
        for snapshot in snapshots[:200]:
            page.observe(snapshot)
        async with ClientSession() as session, session.ws_connect(url + "live") as socket:
            messages = [strict(await socket.receive_str()) for _ in range(2)]
            for snapshot in snapshots[200:400]:
                page.observe(snapshot)
            page.finish(grade(stack(snapshots), CriteriaConfig(), START_S))
            while messages[-1]["type"] != "result":
                messages.append(strict(await socket.receive_str()))
            assert page.watched
        return messages

    introduction, past, *frames, result = serve(page, visit)
    assert introduction["type"] == "run"
    assert introduction["vehicles"] == 6
    assert introduction["paced"] is True
    assert past["type"] == "past"
    assert [round(frame["t"]) for frame in past["frames"]] == list(range(20))
    assert {frame["type"] for frame in frames} == {"frame"}
    assert frames[-1]["t"] == pytest.approx(39.9)
    vehicle = frames[-1]["vehicles"][0]
    assert vehicle["point"] == 0
    assert vehicle["at"] == pytest.approx(snapshots[399].position[0].tolist(), abs=1e-3)
    assert result["success"] is True
    assert len(json.dumps(frames[-1])) < 3000


def test_pace_obeys_the_viewer_and_nonsense_has_no_effect() -> None:
    pace = Pace(8.0)
    page = LivePage(load_scenario("demo"), "native", pace)

    async def settle(what: Any) -> None:
        for _ in range(200):
            if what():
                return
            await asyncio.sleep(0.01)
        pytest.fail("the page did not obey")

    async def visit(url: str) -> None:
        async with ClientSession() as session, session.ws_connect(url + "live") as socket:
            for nonsense in ("", "{", "[]", '{"speed": 1e9}', '{"speed": true}', '{"paused": 1}', "[" * 3000, "7"):
                await socket.send_str(nonsense)
            await socket.send_str('{"paused": true}')
            await settle(lambda: pace.paused)
            assert pace.speed == 8.0
            await socket.send_str('{"paused": false, "speed": null}')
            await settle(lambda: not pace.paused and pace.speed is None)

    serve(page, visit)


def test_other_sites_are_refused() -> None:
    async def visit(url: str) -> None:
        async with ClientSession() as session:
            async with session.get(url, headers={"Host": "evil.example"}) as response:
                assert response.status == 403
            async with session.get(url + "live", headers={"Origin": "http://evil.example"}) as response:
                assert response.status == 403

    serve(LivePage(load_scenario("demo"), "native", Pace(None)), visit)


def test_a_flood_closes_the_connection_and_the_page_lives_on() -> None:
    async def visit(url: str) -> None:
        async with ClientSession() as session:
            async with session.ws_connect(url + "live") as socket:
                await socket.send_str("x" * 100_000)
                while (await socket.receive()).type is WSMsgType.TEXT:
                    pass
                assert socket.closed
            async with session.ws_connect(url + "live") as socket:
                assert strict(await socket.receive_str())["type"] == "run"

    serve(LivePage(load_scenario("demo"), "native", Pace(None)), visit)


def test_pace_holds_back_and_lets_go() -> None:
    pace = Pace(4.0)
    pace.wait(0.0)
    begun = time.monotonic()
    for k in range(1, 21):
        pace.wait(0.04 * k)
    assert 0.19 <= time.monotonic() - begun < 0.6
    pace.set(speed=None)
    begun = time.monotonic()
    pace.wait(1000.0)
    assert time.monotonic() - begun < 0.1
