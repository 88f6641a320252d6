"""guest_python.py FOLDER MODULE...: puts the modules, and all that they import, where Python looks for them in a guest in
which FOLDER is PYTHONHOME. Extensions bring no libraries along. Exit code 1 where a module is not installed."""
import importlib
import os
import shutil
import sys
import sysconfig

folder = os.path.join(sys.argv[1], "lib", f"python{sys.version_info[0]}.{sys.version_info[1]}")
# What Python loads at its start, for any text, and late: in a function.
late = ["encodings.ascii", "encodings.idna", "encodings.latin_1", "site", "locale", "shutil", "textwrap", "traceback"]
for name in [*late, *sys.argv[2:]]:
    try:
        importlib.import_module(name)
    except ImportError as error:
        sys.exit(f"guest_python.py: {error}")
roots = [sysconfig.get_path("platstdlib"), sysconfig.get_path("stdlib"), "/usr/lib/python3/dist-packages"]
for module in list(sys.modules.values()):
    file = getattr(module, "__file__", None)
    root = next((r for r in roots if file and file.startswith(r + "/")), None)
    if root is None:
        continue
    target = os.path.join(folder, os.path.relpath(file, root))
    os.makedirs(os.path.dirname(target), exist_ok=True)
    shutil.copyfile(file, target)
os.makedirs(os.path.join(folder, "lib-dynload"), exist_ok=True)
