"""One byte of one stored file changed: every reader of the folder has to notice.

``python -m bench changed_bytes`` changes each byte; a trial here changes some at random.
"""

from __future__ import annotations

import shutil

from bench.changed_bytes import FOLDERS, Folder, unnoticed
from bench.fuzz.damage import pick
from bench.fuzz.trials import Target, Trial

BYTES = 12
"""Of one trial."""


def bytes_of_folders(trial: Trial) -> str:
    """Some bytes of one folder, one after the other."""
    rng = trial.rng
    kind = pick(rng, sorted(FOLDERS))
    workspace = trial.material.copy_workspace(trial.folder, "maps", "runs")
    for name in ("folders", "suite"):
        shutil.copytree(trial.material.file(name), trial.folder / name)
    for name in ("turned.scenario.json", "study.toml", "dataset.toml"):
        shutil.copy(trial.material.file(name), trial.folder)
    seed = int(rng.integers(2**32))

    def ask() -> str:
        folder = Folder(kind, workspace, trial.folder)
        found = unnoticed(folder, most=BYTES, seed=seed)
        print(f"{found.changed} {found.asked}")
        return "; ".join(map(str, found.unnoticed[:3]))

    ended = trial.ask(f"bytes of {kind}", ask)
    changed = ended.out.split()
    if len(changed) == 2:
        trial.counts["bytes changed"] += int(changed[0])
        trial.counts["readers asked"] += int(changed[1])
    return kind


BYTE_TARGETS: dict[str, tuple[Target, float]] = {"changed byte": (bytes_of_folders, 1.0)}
"""As :data:`bench.fuzz.file_targets.FILE_TARGETS`."""
