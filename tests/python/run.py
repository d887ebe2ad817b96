"""Runs pytest on this folder; 77, "skipped", where a module that it needs is missing."""

import importlib.util
import os
import sys

if os.environ.get("SURFSEG_SANITIZED") == "thread":
    print("skipped: the thread sanitizer has to be in the program, which is Python")
    sys.exit(77)

missing = [m for m in ("pytest", "numpy", "nibabel") if importlib.util.find_spec(m) is None]
if missing:
    print("skipped: Python has no", ", ".join(missing))
    sys.exit(77)

import pytest  # noqa: E402

sys.exit(pytest.main(["-q", "-p", "no:cacheprovider", *sys.argv[1:]]))
