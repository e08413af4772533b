"""A recording can be read back by the standard reader, and its bytes depend on the run alone."""

import io
import json
from dataclasses import replace

import pytest
from mcap.reader import make_reader

from sim.history import Event, Snapshot
from sim.record import SCHEMAS, Recorder
from tests.sim.synthetic import fleet_swims


def recording(snapshots: list[Snapshot]) -> bytes:
    stream = io.BytesIO()
    with Recorder(stream, "synthetic", 7, "native", 3) as recorder:
        for snapshot in snapshots:
            recorder.observe(snapshot)
    return stream.getvalue()


def test_what_is_recorded_is_read_back() -> None:
    snapshots = fleet_swims()[:120]
    snapshots[60] = replace(snapshots[60], events=(Event(6.0, 2, "armed"),))
    reader = make_reader(io.BytesIO(recording(snapshots)))
    messages: dict[str, list[tuple[int, dict[str, object]]]] = {}
    for schema, channel, message in reader.iter_messages():
        assert schema is not None
        assert schema.name in SCHEMAS
        messages.setdefault(channel.topic, []).append((message.log_time, json.loads(message.data)))
    assert len(messages["/vehicle_3/pose"]) == len(messages["/formation"]) == 120
    assert messages["/events"] == [
        (6_000_000_000, {"timestamp": {"sec": 6, "nsec": 0}, "level": 2, "message": "armed", "name": "vehicle_2"})
    ]
    assert messages["/vehicle_1/status"][60] == (6_000_000_000, snapshots[60].statuses[0])
    last = messages["/vehicle_1/truth"][-1][1]
    assert last["tracking_error_m"] == pytest.approx(
        float(abs(snapshots[-1].position[0, 0] - snapshots[-1].points[0, 0])), abs=1e-5
    )
    metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    assert metadata["run"] == {"scenario": "synthetic", "seed": "7", "mcu": "native", "vehicles": "3"}


def test_what_a_companion_said_before_the_start_stands_at_the_start() -> None:
    snapshots = fleet_swims()[:2]
    snapshots[0] = replace(snapshots[0], events=(Event(-1.25, 1, "link: nothing heard"),))
    reader = make_reader(io.BytesIO(recording(snapshots)))
    said = [(m.log_time, json.loads(m.data)["message"]) for _, c, m in reader.iter_messages() if c.topic == "/events"]
    assert said == [(0, "link: nothing heard (1.25 s before the start)")]


def test_same_run_same_bytes() -> None:
    assert recording(fleet_swims()) == recording(fleet_swims())
