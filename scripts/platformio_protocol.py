"""Generates the MAVLink headers before PlatformIO compiles, with the pymavlink that requirements.txt pins."""

import re
import subprocess
from pathlib import Path

Import("env")  # type: ignore[name-defined]  # noqa: F821

root = Path(env.subst("$PROJECT_DIR"))  # type: ignore[name-defined]  # noqa: F821
python = env.subst("$PYTHONEXE")  # type: ignore[name-defined]  # noqa: F821
pinned = re.search(r"^pymavlink==\S+", (root / "requirements.txt").read_text(), re.MULTILINE)
if pinned is None:
    raise SystemExit("requirements.txt: pins no pymavlink")
if subprocess.run([python, "-c", "import pymavlink"], check=False, capture_output=True).returncode:
    subprocess.run([python, "-m", "pip", "install", "--quiet", pinned[0]], check=True)
subprocess.run([python, root / "protocol/generate.py"], check=True)
