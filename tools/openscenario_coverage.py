"""Which elements of OpenSCENARIO are read and written: the table of docs/openscenario-coverage.md.

The elements are those of the schemas, in ``openscenario_elements.txt``. An element is read or
written if the sources of the readers or writers name it. One that the readers do not name is
refused where it would act, and ignored elsewhere, for that is what they do with it.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from pathlib import Path
from typing import Final, NamedTuple

from odscen.formats.openscenario_import.story.read_actions import IGNORED

ROOT: Final = Path(__file__).parents[1]
LIST: Final = Path(__file__).with_name("openscenario_elements.txt")
SOURCES: Final = ROOT / "src" / "odscen" / "formats"
ACTING: Final = frozenset({
    "PrivateAction", "LongitudinalAction", "LateralAction", "RoutingAction", "Position",
    "EntityCondition", "ByValueCondition", "Shape", "ScenarioObject",
    "DeterministicSingleParameterDistribution", "DeterministicMultiParameterDistribution",
    "StochasticDistribution",
})  # fmt: skip
"""Elements of which each kind inside acts: one without a reader is refused."""
SECTIONS: Final = {
    "Positions": ("Position",),
    "Trajectories and routes": ("Trajectory", "TrajectoryRef", "Route"),
    "Environment": ("Environment", "EnvironmentAction"),
    "Conditions": ("Condition", "StartTrigger", "StopTrigger"),
    "Actions": ("PrivateAction", "GlobalAction", "UserDefinedAction"),
    "Entities": ("Entities", "Vehicle", "Pedestrian", "MiscObject", "Controller"),
    "Parameters and distributions": (
        "ParameterDeclarations", "ParameterValueDistribution", "VariableDeclarations",
        "ParameterAssignments", "MonitorDeclarations",
    ),
    "Storyboard": ("Storyboard",),
    "File, map and catalogs": ("OpenSCENARIO",),
}  # fmt: skip
"""Sections of the table; an element is in the first below whose elements it can stand."""
PASSED: Final = frozenset({
    "OpenSCENARIO", "LongitudinalAction", "LateralAction", "RoutingAction", "Condition",
    "AbsoluteTargetSpeed", "AbsoluteTargetLaneOffset", "TimeToCollisionConditionTarget",
    "AbsoluteSpeed", "TargetDistanceSteadyState",
    "DeterministicSingleParameterDistribution",
    *(f"{kind}Catalog" for kind in ("Vehicle", "Controller", "Pedestrian", "MiscObject",
                                    "Environment", "Maneuver", "Trajectory", "Route")),
})  # fmt: skip
"""Read without being named, as content of what they stand in."""
_LOOKS: Final = "ignored", "controllers, lights and looks do not act in SUMO; `--ego`"
_CONTROLLERS: Final = "approximated", "SUMO drives where a controller is activated, else the story"
REMARKS: Final = {
    "ActivateControllerAction": _CONTROLLERS,
    "AssignControllerAction": _CONTROLLERS,
    "ControllerAction": _CONTROLLERS,
    "ObjectController": ("ignored", "a controller is a program beside the file; `--ego`"),
    "GlobalAction": ("approximated", "as far as the actions in it"),
    "EnvironmentAction": ("read", "at first; in a story the weather stays as it is"),
    "Fog": ("approximated", "50 m of sight at least, everywhere"),
    "Wind": ("approximated", "its strength"),
    "RoadCondition": ("approximated", "friction of 0.7 to 1, as wetness"),
    "TrafficSignals": ("ignored", "lights have the program of the map"),
    "TrafficSignalController": ("ignored", "lights have the program of the map"),
    "Phase": ("ignored", "but for its first green, where it is named"),
    "TrafficSignalState": ("ignored", "but for its first green, where it is named"),
    "TrafficSignalStateAction": ("approximated", "green and off; the program resumes from there"),
    "TrafficSignalControllerAction": ("approximated", "to the first green of the phase"),
    "TrafficSignalControllerCondition": ("approximated", "while the first green of the phase is"),
    "VariableAction": ("approximated", "in conditions, as the trigger of its event"),
    "ParameterAction": ("approximated", "in conditions, as the trigger of its event"),
    "TrafficAction": ("ignored", "but for the kinds that are refused"),
    "TrafficSourceAction": ("refused", "traffic of the file; give the scenario flows or demand"),
    "TrafficSwarmAction": ("refused", "traffic of the file; give the scenario flows or demand"),
    "TrafficAreaAction": ("refused", "traffic of the file; give the scenario flows or demand"),
    "TrafficStopAction": ("ignored", "there is no traffic of the file"),
    "SetMonitorAction": ("ignored", ""),
    "UserDefinedAction": ("ignored", "commands of a program beside the file"),
    "Trailer": ("ignored", ""),
    "FromCurrentEntity": ("approximated", "where that entity starts"),
    "LaneChangeActionDynamics": ("approximated", "a step takes 0.1 s"),
    "LaneOffsetAction": ("approximated", "without `maxLateralAcc` over 3 s"),
    "RelativeSpeedToMaster": ("approximated", "relative to the last speed that the file gives"),
    "RelativeTargetSpeed": ("approximated", "relative to the last speed that the file gives"),
    "AbsoluteTargetLane": ("approximated", "from the last lane that the file names"),
    "FollowTrajectoryAction": ("approximated", "from where the actor is"),
    "InRoutePosition": ("approximated", "along the lane of the first waypoint"),
    "RouteRef": ("approximated", "along the lane of the first waypoint"),
    "Waypoint": ("approximated", "the last one is the goal"),
    "Route": ("approximated", "its last place is the goal"),
    "ParameterCondition": ("approximated", "the declared value, and what actions set"),
    "VariableCondition": ("approximated", "the declared value, and what actions set"),
    "MiscObject": ("approximated", "a stationary car"),
    "Performance": ("approximated", "limits speeds that change over time or by a rate"),
    "DynamicConstraints": ("approximated", "`maxAcceleration` holds for braking too"),
    "VariableDeclaration": ("approximated", "the value is put in where it is named"),
    "ValueConstraint": ("approximated", "a least and a greatest value, both possible"),
    "StochasticDistribution": ("approximated", "drawn at import, by the seed"),
}
"""What the sources do not say by themselves: verdict and remark."""


class Covered(NamedTuple):
    """An element, where it stands, its versions, its verdict, and whether it is written."""

    element: str
    parents: tuple[str, ...]
    versions: tuple[str, ...]
    section: str
    verdict: str
    written: bool
    remark: str


def standard() -> dict[tuple[str, str], tuple[str, ...]]:
    """Versions of each parent and element of the standard."""
    lines = LIST.read_text(encoding="utf-8").splitlines()
    rows = [line.split() for line in lines if not line.startswith("#")]
    return {(parent, element): tuple(said.split(",")) for parent, element, said in rows}


def named_in(*folders: Path) -> frozenset[str]:
    """Names that stand in the texts of Python sources, but not in words for people."""
    found: set[str] = set()
    for folder in folders:
        for file in sorted(folder.rglob("*.py")) if folder.is_dir() else [folder]:
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
                text = node.value if isinstance(node, ast.Constant) else None
                if isinstance(text, str) and not re.search(r"\s", text):
                    found.update(re.findall(r"[A-Za-z]+", text))
    return frozenset(found)


def covered() -> list[Covered]:
    """Each element of the standard, by sections and names."""
    pairs = standard()
    parents: dict[str, set[str]] = defaultdict(set)
    versions: dict[str, set[str]] = defaultdict(set)
    for (parent, element), said in pairs.items():
        parents[element].add(parent)
        versions[element].update(said)
    parents["OpenSCENARIO"] = set()
    versions["OpenSCENARIO"] = {"1.0", "1.1", "1.2", "1.3"}
    read = named_in(SOURCES / "openscenario_import") | PASSED
    written = named_in(SOURCES / "openscenario", SOURCES / "openscenario_format.py")
    verdicts = _verdicts(parents, read)
    sections = _sections(parents)
    rows = [
        Covered(
            one, tuple(sorted(parents[one])), tuple(sorted(versions[one])), sections[one],
            *verdicts[one][:1], one in written or one == "OpenSCENARIO", verdicts[one][1],
        )
        for one in parents
    ]  # fmt: skip
    order = list(SECTIONS)
    return sorted(rows, key=lambda row: (order.index(row.section), row.element))


def _verdicts(parents: dict[str, set[str]], read: frozenset[str]) -> dict[str, tuple[str, str]]:
    found: dict[str, tuple[str, str]] = {}
    for element, above in parents.items():
        if element in REMARKS:
            found[element] = REMARKS[element]
        elif element in IGNORED:
            found[element] = _LOOKS
        elif element in read:
            found[element] = "read", ""
        elif above & ACTING:
            found[element] = "refused", ""
    left = sorted(parents.keys() - found.keys())
    while left:
        again = []
        for element in left:
            above = {found[one][0] for one in parents[element] if one in found}
            if len(above) == 1 and above <= {"refused", "ignored"}:
                found[element] = above.pop(), "with the element around it"
            else:
                again.append(element)
        if again == left:
            found |= dict.fromkeys(again, ("ignored", ""))
            break
        left = again
    return found


def _sections(parents: dict[str, set[str]]) -> dict[str, str]:
    children: dict[str, set[str]] = defaultdict(set)
    for element, above in parents.items():
        for one in above:
            children[one].add(element)
    roots = {root for tags in SECTIONS.values() for root in tags}
    found: dict[str, str] = {}
    for section, tags in SECTIONS.items():
        left = [tag for tag in tags if tag in parents]
        while left:
            one = left.pop()
            if one not in found:
                found[one] = section
                left += [child for child in sorted(children[one]) if child not in roots]
    return found


def coverage_tables() -> str:
    """Markdown: a count, and a table for each section."""
    rows = covered()
    lines = []
    counts = [f"{sum(r.verdict == v for r in rows)} {v}"
              for v in ("read", "approximated", "ignored", "refused")]  # fmt: skip
    written = sum(row.written for row in rows)
    lines.append(f"{len(rows)} elements: {', '.join(counts)}; {written} written.")
    for section in SECTIONS:
        lines += ["", f"## {section}", "", "| Element | In | From | Import | Export | Remarks |"]
        lines.append("|---|---|---|---|---|---|")
        lines += [_line(row) for row in rows if row.section == section]
    return "\n".join(lines) + "\n"


def _line(row: Covered) -> str:
    inside = " ".join(f"`{one}`" for one in row.parents[:4])
    inside += " ..." if len(row.parents) > 4 else ""
    versions = row.versions[0]
    if row.versions[-1] != "1.3":
        versions += f" to {row.versions[-1]}"
    written = "written" if row.written else "-"
    return f"| `{row.element}` | {inside} | {versions} | {row.verdict} | {written} | {row.remark} |"
