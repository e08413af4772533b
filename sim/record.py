"""Writes a run as MCAP, with Foxglove's schemas where they fit; the bytes depend on the run alone."""

from __future__ import annotations

import json
from types import TracebackType
from typing import Any, BinaryIO

import numpy as np
from mcap.writer import CompressionType, Writer

from companion.events import Severity
from sim.history import Array, Event, Snapshot
from sim.world import pairs

MAP_FRAME, MISSION_FRAME = "map", "mission_ned"
_NANOSECONDS = 1_000_000_000
_LEVELS = {Severity.INFO: 2, Severity.WARNING: 3, Severity.ERROR: 4}  # of foxglove.Log
_NUMBER = {"type": "number"}
_TEXT = {"type": "string"}


def _object(**properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties}


def _list(items: Any) -> dict[str, Any]:
    return {"type": "array", "items": items}


_TIME = {"title": "time", **_object(sec={"type": "integer", "minimum": 0}, nsec={"type": "integer", "minimum": 0})}
_VECTOR = {"title": "foxglove.Vector3", **_object(x=_NUMBER, y=_NUMBER, z=_NUMBER)}
_QUATERNION = {"title": "foxglove.Quaternion", **_object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)}
_POSE = {"title": "foxglove.Pose", **_object(position=_VECTOR, orientation=_QUATERNION)}
_COLOUR = {"title": "foxglove.Color", **_object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)}
_SPHERE = _object(pose=_POSE, size=_VECTOR, color=_COLOUR)
_ENTITY = _object(
    timestamp=_TIME, frame_id=_TEXT, id=_TEXT, lifetime=_TIME, frame_locked={"type": "boolean"}, spheres=_list(_SPHERE)
)

SCHEMAS: dict[str, dict[str, Any]] = {
    "foxglove.FrameTransform": _object(
        timestamp=_TIME, parent_frame_id=_TEXT, child_frame_id=_TEXT, translation=_VECTOR, rotation=_QUATERNION
    ),
    "foxglove.PoseInFrame": _object(timestamp=_TIME, frame_id=_TEXT, pose=_POSE),
    "foxglove.SceneUpdate": _object(entities=_list(_ENTITY)),
    "foxglove.Log": _object(timestamp=_TIME, level={"type": "integer"}, message=_TEXT, name=_TEXT),
    "shoal.Truth": _object(
        velocity_mps=_list(_NUMBER),
        euler_rad=_list(_NUMBER),
        current_mps=_list(_NUMBER),
        travelled_m=_NUMBER,
        pulses_us=_list(_NUMBER),
        nearest_hull_m={"type": ["number", "null"]},
        tracking_error_m={"type": ["number", "null"]},
    ),
    "shoal.Formation": _object(phase=_TEXT, heading_rad=_NUMBER, points_m=_list(_list(_NUMBER))),
    "shoal.Status": {"type": "object", "description": "What the companion reports after a tick"},
}


class Recorder:
    """Takes snapshots and writes them to a binary stream; use it as a context manager so that the file gets its end."""

    def __init__(self, stream: BinaryIO, scenario: str, seed: int, mcu: str, vehicles: int) -> None:
        self._writer = Writer(stream, compression=CompressionType.ZSTD)
        self._writer.start(profile="", library="shoal")
        self._writer.add_metadata(
            "run", {"scenario": scenario, "seed": str(seed), "mcu": mcu, "vehicles": str(vehicles)}
        )
        self._schemas = {
            name: self._writer.register_schema(name, "jsonschema", _dump({"title": name, **schema}))
            for name, schema in SCHEMAS.items()
        }
        self._channels: dict[str, int] = {}
        self._count = 0
        # North, east, down seen from a map of east, north, up: half a turn about the axis between north and east.
        rotation = {"x": 0.5**0.5, "y": 0.5**0.5, "z": 0.0, "w": 0.0}
        transform = {"parent_frame_id": MAP_FRAME, "child_frame_id": MISSION_FRAME, "rotation": rotation}
        self._write("/tf", "foxglove.FrameTransform", 0.0, {**transform, "translation": _vector(np.zeros(3))}, True)

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._writer.finish()  # type: ignore[no-untyped-call]

    def observe(self, snapshot: Snapshot) -> None:
        """Adds everything of one snapshot."""
        now, count, decided = snapshot.now, len(snapshot.position), snapshot.decided
        nearest = nearest_hulls(snapshot.separation, count)
        formation = {
            "phase": snapshot.phase.value,
            "heading_rad": round(snapshot.heading, 6),
            "points_m": _rounded(snapshot.points),
        }
        self._write("/formation", "shoal.Formation", now, formation)
        self._write("/scene", "foxglove.SceneUpdate", now, {"entities": [_points_entity(snapshot)]})
        for i in range(count):
            topic, point = f"/vehicle_{i + 1}", int(decided[i])
            pose = {"position": _vector(snapshot.position[i]), "orientation": _quaternion(snapshot.euler[i])}
            self._write(f"{topic}/pose", "foxglove.PoseInFrame", now, {"frame_id": MISSION_FRAME, "pose": pose}, True)
            error = float(np.linalg.norm(snapshot.position[i] - snapshot.points[point])) if point >= 0 else None
            truth = {
                "velocity_mps": _rounded(snapshot.velocity[i]),
                "euler_rad": _rounded(snapshot.euler[i]),
                "current_mps": _rounded(snapshot.current[i]),
                "travelled_m": round(float(snapshot.travelled[i]), 6),
                "pulses_us": _rounded(snapshot.pulses[i]),
                "nearest_hull_m": round(float(nearest[i]), 6) if np.isfinite(nearest[i]) else None,
                "tracking_error_m": None if error is None else round(error, 6),
            }
            self._write(f"{topic}/truth", "shoal.Truth", now, truth)
            if (status := snapshot.statuses[i]) is not None:
                self._write(f"{topic}/status", "shoal.Status", now, status)
        for event in snapshot.events:
            self._event(event)

    def _event(self, event: Event) -> None:
        # MCAP counts time from zero, the start; companions of their own are heard before it.
        early = f" ({-event.stamp:.2f} s before the start)" if event.stamp < 0.0 else ""
        name = f"vehicle_{event.vehicle}" if event.vehicle else "fleet"
        log = {"level": _LEVELS[event.severity], "message": event.text + early, "name": name}
        self._write("/events", "foxglove.Log", max(event.stamp, 0.0), log, True)

    # One message; `stamped` adds the time in Foxglove's own field.
    def _write(self, topic: str, schema: str, now: float, message: dict[str, Any], stamped: bool = False) -> None:
        if topic not in self._channels:
            self._channels[topic] = self._writer.register_channel(topic, "json", self._schemas[schema])
        stamp = round(now * _NANOSECONDS)
        if stamped:
            message = {"timestamp": _time(now), **message}
        self._writer.add_message(self._channels[topic], stamp, _dump(message), stamp, self._count)
        self._count += 1


def nearest_hulls(separation: Array, count: int) -> Array:
    """Least distance (N,) m of each hull to another from those of all pairs (P,); inf for a lone vehicle."""
    square = np.full((count, count), np.inf)
    first, second = pairs(count)
    square[first, second] = square[second, first] = separation
    return np.asarray(square.min(axis=1))


def _points_entity(snapshot: Snapshot) -> dict[str, Any]:
    held = set(snapshot.decided.tolist())
    size = {"x": 0.3, "y": 0.3, "z": 0.3}
    upright = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    spheres = [
        {
            "pose": {"position": _vector(point), "orientation": upright},
            "size": size,
            "color": {"r": 0.0, "g": 0.45, "b": 0.7, "a": 0.8 if index in held else 0.25},
        }
        for index, point in enumerate(snapshot.points)
    ]
    return {
        "timestamp": _time(snapshot.now),
        "frame_id": MISSION_FRAME,
        "id": "points",
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": False,
        "spheres": spheres,
    }


# Z-Y-X Euler angles as a quaternion.
def _quaternion(euler: Array) -> dict[str, float]:
    (cr, cp, cy), (sr, sp, sy) = np.cos(euler / 2.0).tolist(), np.sin(euler / 2.0).tolist()
    values = {
        "x": sr * cp * cy - cr * sp * sy,
        "y": cr * sp * cy + sr * cp * sy,
        "z": cr * cp * sy - sr * sp * cy,
        "w": cr * cp * cy + sr * sp * sy,
    }
    return {axis: round(value, 6) for axis, value in values.items()}


def _vector(value: Array) -> dict[str, float]:
    return {axis: round(component, 6) for axis, component in zip("xyz", value.tolist(), strict=True)}


def _rounded(values: Array) -> Any:
    return np.round(values, 6).tolist()


def _time(now: float) -> dict[str, int]:
    seconds, rest = divmod(round(now * _NANOSECONDS), _NANOSECONDS)
    return {"sec": seconds, "nsec": rest}


def _dump(value: Any) -> bytes:
    return json.dumps(value, separators=(",", ":"), allow_nan=False).encode()
