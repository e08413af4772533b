"""Reads a TOML file into a declared dataclass and lists everything that is wrong with it at once."""

from __future__ import annotations

import dataclasses
import datetime
import difflib
import math
import re
import tomllib
import types
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar, Union

from companion.config.errors import MISSING, ConfigError, Problem
from companion.config.options import Option, declaration

T = TypeVar("T")

_TYPE_NAMES = {bool: "true or false", int: "a whole number", float: "a number", str: "a text", Path: "a path"}
_BAD: Any = object()  # stands for a value that was complained about


def load(kind: type[T], path: Path | str) -> T:
    """Reads the file at `path`; raises ConfigError with every problem found in it."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError([f"{path}: cannot be read: {error.strerror}"]) from error
    except UnicodeDecodeError as error:
        raise ConfigError([f"{path}: must be UTF-8 text: byte {error.start} is not"]) from error
    return loads(kind, text, str(path))


def loads(kind: type[T], text: str, file: str) -> T:
    """Reads TOML text that came from `file`, which also anchors relative paths; raises ConfigError."""
    try:
        table = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ConfigError([f"{file}: must be TOML: {error}"]) from error
    return from_table(kind, table, file)


def from_table(kind: type[T], table: Mapping[str, Any], file: str, section: str = "") -> T:
    """Builds `kind` from a parsed table, standing for [section] of `file`; raises ConfigError."""
    reader = _Reader(Path(file).parent)
    value = reader.table(kind, table, section)
    if reader.problems:
        raise ConfigError([problem.line(file) for problem in reader.problems])
    return typing.cast(T, value)


class _Reader:
    """Walks declaration and table together, collecting problems on the way."""

    def __init__(self, base: Path) -> None:
        self.base = base
        self.problems: list[Problem] = []

    def table(self, kind: type[Any], table: Mapping[str, Any], section: str) -> Any:
        """One table into one dataclass; the checks between settings run only where each setting is good by itself."""
        before = len(self.problems)
        fields = {field.name: field for field in dataclasses.fields(kind) if field.init}
        hints = typing.get_type_hints(kind)
        for key in table:
            if key not in fields:
                self.unknown(section, key, table[key], list(fields))
        values = {}
        for name, field in fields.items():
            if name in table:
                values[name] = self.value(hints[name], table[name], section, name, declaration(field))
            elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
                self.missing(hints[name], section, name, declaration(field))
        if len(self.problems) > before:
            return _BAD
        built = kind(**values)
        for problem in built.problems() if hasattr(built, "problems") else ():
            inner = ".".join(part for part in (section, problem.section) if part)
            self.problems.append(dataclasses.replace(problem, section=inner))
        return built

    def unknown(self, section: str, key: str, value: object, known: list[str]) -> None:
        near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]}?" if near else "known keys: " + ", ".join(known)
        where = f"[{section}]" if section else "this file"
        self.problems.append(Problem(section, key, value, f"unknown key, must be one of those of {where} ({hint})"))

    def missing(self, hint: Any, section: str, key: str, declared: Option) -> None:
        if dataclasses.is_dataclass(hint):
            inner = f"{section}.{key}" if section else key
            self.problems.append(Problem(inner, "", MISSING, f"this section is missing ({declared.meaning})"))
            return
        what = "; ".join(part for part in (declared.meaning, declared.expectation()) if part)
        self.problems.append(Problem(section, key, MISSING, f"must be given ({what})"))

    def complain(self, section: str, key: str, value: object, must: str, declared: Option) -> Any:
        """Complains about one value in the words of its declaration."""
        allowed = declared.expectation()
        suffix = f" ({allowed})" if allowed and allowed not in must else ""
        self.problems.append(Problem(section, key, value, f"must be {must}{suffix}"))
        return _BAD

    def value(self, hint: Any, value: Any, section: str, key: str, declared: Option) -> Any:
        """One value of any declared type."""
        origin = typing.get_origin(hint)
        if origin in (Union, types.UnionType):
            [hint] = [part for part in typing.get_args(hint) if part is not type(None)]
            return self.value(hint, value, section, key, declared)
        if dataclasses.is_dataclass(hint):
            inner = f"{section}.{key}" if section else key
            if not isinstance(value, dict):
                return self.complain(section, key, value, f"a table, written [{inner}]", declared)
            return self.table(typing.cast(type, hint), value, inner)
        if origin is tuple:
            return self.sequence(hint, value, section, key, declared)
        if origin is dict:
            return self.mapping(hint, value, section, key, declared)
        return self.scalar(hint, value, section, key, declared)

    def sequence(self, hint: Any, value: Any, section: str, key: str, declared: Option) -> Any:
        arguments = typing.get_args(hint)
        tables = dataclasses.is_dataclass(arguments[0])
        if declared.csv and isinstance(value, str):
            value = self.rows(value, section, key, declared)
            if value is _BAD:
                return _BAD
        if not isinstance(value, list) or (tables and not all(isinstance(item, dict) for item in value)):
            must = f"tables, each written [[{key}]]" if tables else "a list, written [a, b, ...]"
            return self.complain(section, key, value, must, declared)
        if arguments[-1] is not Ellipsis:
            if len(value) != len(arguments):
                return self.complain(section, key, value, f"a list of {len(arguments)} values", declared)
            inner = list(arguments)
        else:
            if len(value) < declared.least:
                return self.complain(section, key, value, f"a list of at least {declared.least} values", declared)
            inner = [arguments[0]] * len(value)
        built = []
        for index, (item_hint, item) in enumerate(zip(inner, value, strict=True)):
            name = f"{key}[{index}]"
            if isinstance(item, list) and declared.lengths and len(item) not in declared.lengths:
                lengths = " or ".join(str(length) for length in declared.lengths)
                built.append(self.complain(section, name, item, f"a list of {lengths} values", declared))
            else:
                built.append(self.value(item_hint, item, section, name, declared))
        return tuple(built)

    def rows(self, name: str, section: str, key: str, declared: Option) -> Any:
        """The lists of numbers in a file of comma-separated values; blank lines, # lines and a line of names go by."""
        try:
            lines = (self.base / name).read_text(encoding="utf-8-sig").splitlines()
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or "it is no text"
            return self.complain(section, key, name, f"a list, or the name of a file that can be read: {why}", declared)
        found: list[list[float]] = []
        named = False
        for number, line in enumerate(lines, 1):
            if not line.strip() or line.lstrip().startswith("#"):
                continue
            try:
                found.append([float(cell) for cell in line.split(",")])
            except ValueError:
                if found or named:
                    return self.complain(section, key, name, f"a file of numbers, line {number} is not", declared)
                named = True
        return found

    def mapping(self, hint: Any, value: Any, section: str, key: str, declared: Option) -> Any:
        inner = f"{section}.{key}" if section else key
        if not isinstance(value, dict):
            return self.complain(section, key, value, f"a table, written [{inner}]", declared)
        pattern = declared.pattern
        for name in value:
            if pattern and not re.fullmatch(pattern, name):
                self.problems.append(Problem(inner, name, value[name], f"its name must match {pattern}"))
        rest = dataclasses.replace(declared, pattern="")
        return {name: self.value(typing.get_args(hint)[1], item, inner, name, rest) for name, item in value.items()}

    def scalar(self, hint: Any, value: Any, section: str, key: str, declared: Option) -> Any:
        if hint is datetime.datetime:
            if not isinstance(value, datetime.datetime) or value.tzinfo is None:
                text = "a date and time with offset, such as 2026-06-01T10:00:00Z"
                return self.complain(section, key, value, text, declared)
            return value
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        good = {
            bool: isinstance(value, bool),
            int: is_number and isinstance(value, int),
            float: is_number,
            str: isinstance(value, str),
            Path: isinstance(value, str) and bool(value) and "\0" not in value,
        }
        if not good[hint]:
            return self.complain(section, key, value, _TYPE_NAMES[hint], declared)
        if hint is Path:
            return self.base / value
        if declared.choices and value not in declared.choices:
            near = difflib.get_close_matches(str(value), [str(choice) for choice in declared.choices], n=1)
            must = declared.expectation() + (f"; did you mean {near[0]}?" if near else "")
            return self.complain(section, key, value, must, declared)
        if isinstance(value, str):
            if declared.pattern and not re.fullmatch(declared.pattern, value):
                return self.complain(section, key, value, f"a text that matches {declared.pattern}", declared)
            return value
        return value if hint is bool else self.number(hint, value, section, key, declared)

    def number(self, hint: Any, value: Any, section: str, key: str, declared: Option) -> Any:
        if hint is float:
            try:
                value = float(value)
            except OverflowError:
                return self.complain(section, key, value, "a finite number", declared)
        if not math.isfinite(value) and not (value == math.inf == declared.high):
            return self.complain(section, key, value, "a finite number", declared)
        low = declared.low is None or value >= declared.low
        high = declared.high is None or value <= declared.high
        above = declared.above is None or value > declared.above
        return value if low and high and above else self.complain(section, key, value, declared.expectation(), declared)
