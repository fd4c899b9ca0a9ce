"""An agent learns to switch lights, and is judged beside what lights have today.

Run it with ``python examples/learn_lights.py [WORKSPACE [EPISODES]]``; training takes four to ten
minutes of one processor, the comparison four more. docs/behaviour.md says what comes out.
"""

from __future__ import annotations

import sys
import tempfile

import odscen
from odscen import demand, edit, rl

TRIPS = {"signal_crossing": 250, "left_hand_crossing": 200}
SEEDS = tuple(range(1, 31))


def rush_hour(workspace: odscen.Workspace, name: str) -> odscen.Scenario:
    workspace.add_map(next(path for path in odscen.shipped_maps() if path.stem == name))
    graph = workspace.map(name).graph()
    empty = edit.new_scenario(graph, name=f"rush-{name}", roi=graph.segments.ids)
    timed = edit.set_simulation(empty, duration=600)
    return demand.add_background(workspace, timed, name="all", trips=TRIPS[name])


def learn(workspace: odscen.Workspace, episodes: int) -> None:
    scenarios = [rush_hour(workspace, name) for name in TRIPS]
    agent = rl.train_signals(workspace, scenarios, episodes=episodes, batch=4)
    file = agent.save(workspace.root / "agent.npz")
    for scenario in scenarios:
        for runs in rl.compare_controls(workspace, scenario, agent=file, seeds=SEEDS):
            found = runs.difference
            interval = f"{found.difference:+.1f} s ({found.low:+.1f} to {found.high:+.1f})"
            print(f"{scenario.map.name}, {runs.control}: {found.b:.1f} s, {interval}")


if __name__ == "__main__":
    root = sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp()
    learn(odscen.Workspace.open(root), int(sys.argv[2]) if sys.argv[2:] else 440)
