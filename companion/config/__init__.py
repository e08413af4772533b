"""Settings declared once as dataclasses, read from TOML with errors that name file, section, key, value and range."""

from companion.config.errors import MISSING, ConfigError, Problem
from companion.config.loader import from_table, load, loads
from companion.config.options import option, section

__all__ = ["MISSING", "ConfigError", "Problem", "from_table", "load", "loads", "option", "section"]
