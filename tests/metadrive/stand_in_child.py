"""In the place of MetaDrive's process: all are where the job has them, and the driven touch nobody.

``MISBEHAVE`` says what goes wrong: ``ends`` after ten steps with a code, ``contact`` of the first
two for three steps, ``leaves``: the first one is gone from step 20 on.
"""

import json
import os
import sys
from pathlib import Path

import numpy as np

folder = Path(sys.argv[1])
job = json.loads((folder / "job.json").read_text(encoding="utf-8"))
stored = np.load(folder / "job.npz")
wrong = os.environ.get("MISBEHAVE", "")
start = stored["start"]
first = [int(row) for row in stored["row"][start[12] : start[13]][:2]]
for index in range(len(start) - 1):
    if wrong == "ends" and index == 10:
        sys.exit("the stand-in was told to end")
    users = []
    for at in range(start[index], start[index + 1]):
        if wrong == "leaves" and index >= 20 and stored["row"][at] == first[0]:
            continue
        users.append(
            [
                int(stored["row"][at]),
                *(float(stored[name][at]) for name in ("x", "y", "hdg", "speed")),
            ]
        )
    contacts = [first] if wrong == "contact" and 12 <= index < 15 else []
    line = {"step": index, "users": users, "contacts": contacts, "off_road": []}
    sys.stdout.write(json.dumps(line) + "\n")
