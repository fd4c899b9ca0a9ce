"""Reads a CommonRoad file with commonroad-io: XSD, scenario, collision checker; in its environment.

``python commonroad_reader.py FILE.xml OUT.json``: positions as read, and counts as JSON on stdout.
"""

import json
import sys
from pathlib import Path

import commonroad
from commonroad.common.file_reader import CommonRoadFileReader
from commonroad.scenario.lanelet import LaneletType
from commonroad_dc.collision.collision_detection.pycrcc_collision_dispatch import (
    create_collision_checker,
)
from commonroad_dc.pycrcc import RectOBB
from lxml import etree

XSD = "scenario_definition/xml_definition_files/XML_commonRoad_XSD.xsd"


def main(file, out):
    schema = etree.XMLSchema(etree.parse(str(Path(commonroad.__file__).parent / XSD)))
    schema.assertValid(etree.parse(file, etree.XMLParser(huge_tree=True)))
    scenario, problems = CommonRoadFileReader(file).open()
    network = scenario.lanelet_network
    lanelets = {one.lanelet_id for one in network.lanelets}
    for one in network.lanelets:
        assert set(one.predecessor) | set(one.successor) <= lanelets
        assert one.left_vertices.shape == one.right_vertices.shape
    checker = create_collision_checker(scenario)
    rows, seen, missed = [], set(), []
    for obstacle in scenario.dynamic_obstacles:
        for state in obstacle.prediction.trajectory.state_list:
            x, y = map(float, state.position)
            rows.append((obstacle.obstacle_id, state.time_step, x, y, float(state.orientation)))
            # A box of a centimetre in the middle of the body, at that instant only.
            probe = RectOBB(0.005, 0.005, float(state.orientation), x, y)
            if checker.time_slice(state.time_step).collide(probe):
                seen.add(obstacle.obstacle_id)
            else:
                missed.append((obstacle.obstacle_id, state.time_step))
        first = obstacle.initial_state
        rows.append(
            (obstacle.obstacle_id, 0, *map(float, first.position), float(first.orientation))
        )
    counts = {
        "lanelets": len(lanelets),
        "crosswalks": sum(LaneletType.CROSSWALK in one.lanelet_type for one in network.lanelets),
        "lights": len(network.traffic_lights),
        "signs": len(network.traffic_signs),
        "obstacles": len(scenario.dynamic_obstacles),
        "seen_by_checker": len(seen),
        "states_missed_by_checker": len(missed),
        "planning_problems": len(problems.planning_problem_dict),
        "valid": True,
    }
    Path(out).write_text(json.dumps(rows))
    print(json.dumps(counts))


main(*sys.argv[1:])
