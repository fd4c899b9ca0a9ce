"""Checks a ScenarioDescription and replays it in MetaDrive without a window; in its environment.

``python scenarionet_reader.py FOLDER OUT.json``: poses of all objects at each step as MetaDrive has
them, and counts as JSON on stdout. MetaDrive would download its pictures of cars and ground; an
empty texture and a version are enough for it to go without.
"""

import json
import sys
from pathlib import Path

import metadrive


def pretend_assets():
    folder = Path(metadrive.__file__).parent / "assets"
    texture = folder / "textures" / "grass1" / "GroundGrassGreen002_COL_1K.jpg"
    texture.parent.mkdir(parents=True, exist_ok=True)
    if not texture.exists():
        import cv2
        import numpy as np

        cv2.imwrite(str(texture), np.zeros((8, 8, 3), dtype=np.uint8))
    (folder / "version.txt").write_text(metadrive.constants.VERSION)


def main(folder, out):

    pretend_assets()
    from metadrive.envs.scenario_env import ScenarioEnv
    from metadrive.policy.replay_policy import ReplayEgoCarPolicy
    from metadrive.scenario.scenario_description import ScenarioDescription as Description
    from metadrive.scenario.utils import read_dataset_summary, read_scenario_data

    _summary, names, mapping = read_dataset_summary(folder)
    path = Path(folder) / mapping[names[0]] / names[0]
    scenario = read_scenario_data(str(path))
    Description.sanity_check(scenario, check_self_type=False, valid_check=True)
    length = scenario["length"]
    env = ScenarioEnv(
        {
            "data_directory": str(Path(folder).resolve()),
            "num_scenarios": 1,
            "agent_policy": ReplayEgoCarPolicy,
            "filter_overlapping_car": False,
            "store_map": False,
            "map_region_size": 512,
            "cull_lanes_outside_map": False,
            "horizon": length + 5,
            "log_level": 50,
            "out_of_route_done": False,
        }
    )
    rows = []
    env.reset(seed=0)
    # MetaDrive moves the origin to the first place of the ego, and says where the old one is.
    about = env.engine.data_manager.current_scenario["metadata"]
    origin = about.get("old_origin_in_current_coordinate", (0.0, 0.0))
    light_steps = 0
    for step in range(length):
        manager = env.engine.traffic_manager
        objects = env.engine.get_objects()
        for own, name in manager._scenario_id_to_obj_id.items():
            rows.append((own, step, *pose(objects[name], origin)))
        ego = manager.sdc_scenario_id
        if scenario["tracks"][ego]["state"]["valid"][step]:  # MetaDrive keeps it to the end
            rows.append((ego, step, *pose(env.agent, origin)))
        light_steps += len(env.engine.light_manager._scenario_id_to_obj_id)
        if step + 1 < length:
            env.step([0, 0])
    kinds = [one["type"] for one in scenario["map_features"].values()]
    counts = {
        "length": length,
        "tracks": len(scenario["tracks"]),
        "lanes": sum(kind.startswith("LANE") for kind in kinds),
        "features": len(kinds),
        "lights": len(scenario["dynamic_map_states"]),
        "light_steps": light_steps,
        "map_lanes": len(env.current_map.road_network.graph),
        "replayed": len({row[0] for row in rows}),
    }
    env.close()
    Path(out).write_text(json.dumps(rows))
    print(json.dumps(counts))


def pose(body, origin):
    x, y = body.position
    return float(x - origin[0]), float(y - origin[1]), float(body.heading_theta)


main(*sys.argv[1:])
