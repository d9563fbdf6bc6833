"""On PYTHONPATH before a tree's own `python` folder: that package is imported in place of the installed one."""

import sys

sys.meta_path[:] = [f for f in sys.meta_path if "editable" not in type(f).__module__.lower()]
