"""From SUMO's phases to a program of the scenario: groups, stages, intergreens, plans.

Letters that always change together, on one approach, are a signal group. A phase in which something
begins is a stage; what lies between two stages has to be what the groups' yellow and intergreens
give, or else the program is refused: it is never taken over as something else.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError
from odscen.convert.model.extended_greens import CONTROL_PARAM, MAP_STAGES, STAGES_PARAM
from odscen.formats.tll_loops import taken_detectors
from odscen.formats.tll_stages import (
    GAP,
    STAGE_NAME,
    file_stages,
    first_stage_at,
    green_phase,
    joined_steps,
    main_phases,
    refuse_repeated,
    shown_need,
)
from odscen.scenario.document.problems import validated
from odscen.scenario.document.signals_document import JunctionTiming
from odscen.scenario.signals.light import find_movements, shortest_names
from odscen.scenario.signals.program_design import (
    DesignedProgram,
    beginning_groups,
    change_steps,
    stage_state,
)
from odscen.sumo.realize.lights.light_realization import GROUP_PARAM

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.formats.tll_file import FilePhase, FileProgram
    from odscen.formats.tll_loops import TakenLoop
    from odscen.formats.tll_stages import FileStage
    from odscen.scenario.signals.light import Light


@dataclass(frozen=True, slots=True)
class TakenPlan:
    """A program of the file as it is taken over; ``times`` are those of day, ``06:30:00``."""

    program: FileProgram
    id: str
    times: tuple[str, ...] = ()


def taken_timing(
    light: Light, plans: Sequence[TakenPlan], *, loops: Mapping[str, TakenLoop] | None = None
) -> tuple[JunctionTiming, tuple[str, ...]]:
    """Timing of a light with programs of a file as its plans, and what was taken otherwise.

    Raises
    ------
    InputError
        If a program is not one of stages; names the program and its phase.
    """
    for plan in plans:
        count = len(plan.program.phases[0].state)
        if count != len(light.movements):
            raise InputError(
                f"{plan.program.place}: its states have {count} letters, but the light of this map "
                f"has {len(light.movements)} links; it is of another network"
            )
    if plans[-1].program.params.get(STAGES_PARAM) == MAP_STAGES:
        return called_timing(light, plans[-1].program, loops or {}), ()
    return _ProgramTaker(light, plans, loops or {}).timing()


_LONGEST_PARAM = 1e9
"""Seconds."""


class _ProgramTaker:
    def __init__(
        self,
        light: Light,
        plans: Sequence[TakenPlan],
        loops: Mapping[str, TakenLoop],
    ) -> None:
        self._light = light
        self._plans = plans
        self._loops = loops
        self._cycles = [file_stages(plan.program) for plan in plans]
        self._groups = self._found_groups()
        self._notes: list[str] = []

    def timing(self) -> tuple[JunctionTiming, tuple[str, ...]]:
        design: dict[str, Any] = {
            "junction": self._light.names[0],
            "control": "actuated" if self._is_actuated() else "fixed",
            "groups": self._designed_groups(),
            **self._designed_stages(),
        }
        if detectors := taken_detectors(self._ended_by(), self._loops, self._light):
            design["detectors"] = detectors
        design["intergreens"] = self._intergreen_rows(design)
        timing = _validate_design(design)
        self._compare_with_file(timing)
        return timing, tuple(dict.fromkeys(self._notes))

    def _is_actuated(self) -> bool:
        control = self._plans[0].program.params.get(CONTROL_PARAM)
        longer = any(stage.most > stage.least for stages in self._cycles for stage in stages)
        return longer if control is None else control == "actuated"

    def _ended_by(self) -> dict[str, dict[str, float]]:
        """Gaps of the loops that prolong each stage, by the stage's id."""
        found: dict[str, dict[str, float]] = {}
        for plan, stages in zip(self._plans, self._cycles, strict=True):
            own = plan.program.params
            for stage in stages:
                gaps = found.setdefault(stage.id, {})
                gaps.update(stage.gaps)
                prolonged = stage.most > stage.least or (stage.held and self._is_actuated())
                if prolonged and not stage.gaps:
                    green = {n for n, letter in enumerate(stage.state) if letter in "Gg"}
                    for name, loop in self._loops.items():
                        if own.get(loop.lane) == name and green & set(loop.movements):
                            gaps[name] = _param_number(own, "max-gap", 3.0)
        return found

    def _all_phases(self) -> Iterator[FilePhase]:
        for plan in self._plans:
            yield from plan.program.phases

    # Groups

    def _found_groups(self) -> dict[str, tuple[int, ...]]:
        named = self._named_groups()
        if named:
            return named
        columns: dict[tuple[object, ...], list[int]] = {}
        for n, movement in enumerate(self._light.movements):
            if not movement.turn:
                continue
            letters = tuple(phase.state[n].lower() for phase in self._all_phases())
            key = (movement.walk, movement.approach, *letters)
            columns.setdefault(key, []).append(n)
        found = {}
        numbers = {True: 0, False: 0}
        for key, links in columns.items():
            walk = bool(key[0])
            numbers[walk] += 1
            found[f"{'P' if walk else 'V'}{numbers[walk]}"] = tuple(links)
        return found

    def _named_groups(self) -> dict[str, tuple[int, ...]]:
        """Groups that the file names itself, as our own export does; none if they do not fit."""
        params = self._plans[0].program.params
        found = {
            key.removeprefix(GROUP_PARAM): _link_numbers(value)
            for key, value in params.items()
            if key.startswith(GROUP_PARAM)
        }
        everything = sorted(n for links in found.values() for n in links)
        there = [n for n, movement in enumerate(self._light.movements) if movement.turn]
        return found if everything == there else {}

    def _designed_groups(self) -> list[dict[str, Any]]:
        result = []
        for name, links in self._groups.items():
            group: dict[str, Any] = {
                "id": name,
                "movements": list(shortest_names(links, self._light.movements)),
            }
            known = max(self._light.movements[n].yellow for n in links)
            yellow = self._yellow_of_group(links)
            if yellow is not None and yellow != known:
                group["yellow"] = yellow
            covered = {
                n
                for movement in group["movements"]
                for n in find_movements(movement, self._light.movements)
            }
            if covered != set(links):
                raise InputError(
                    f"letters {sorted(covered - set(links))} and {list(links)} of the states are "
                    "the same movement and must show the same"
                )
            result.append(group)
        return result

    def _yellow_of_group(self, links: tuple[int, ...]) -> float | None:
        """Seconds of yellow of a group; ``None`` if it never ends."""
        found: set[float] = set()
        for plan, stages in zip(self._plans, self._cycles, strict=True):
            letters = [
                (phase.seconds, phase.state[links[0]])
                for stage in stages
                for phase in (green_phase(stage), *stage.steps)
            ]
            found |= set(_yellow_lengths(letters))
            if len(found) > 1:
                times = " and ".join(f"{value:g} s" for value in sorted(found))
                raise InputError(
                    f"{plan.program.place}: letters {list(links)} have yellow of {times}; say one"
                )
        return found.pop() if found else None

    # Stages and plans

    def _designed_stages(self) -> dict[str, Any]:
        """Stages of all plans, and what differs in each plan from the first that has them."""
        stages: dict[tuple[str, str], dict[str, Any]] = {}
        taken: set[str] = set()
        order: list[list[str]] = []
        for cycle in self._cycles:
            ids = []
            for stage in cycle:
                key = (stage.state, str(stage.on_call))
                if key not in stages:
                    stages[key] = self._designed_stage(stage, taken)
                    taken.add(stages[key]["id"])
                stage.id = stages[key]["id"]
                ids.append(stage.id)
            order.append(ids)
        made = list(stages.values())
        default = [stage["id"] for stage in made]
        result: dict[str, Any] = {"stages": made}
        if len(self._plans) == 1:
            return result | self._offset_and_cycle(0)
        plans = []
        known = {stage["id"]: stage for stage in made}
        for number, (plan, cycle) in enumerate(zip(self._plans, self._cycles, strict=True)):
            row: dict[str, Any] = {"id": plan.id, "times": list(plan.times)}
            row |= self._offset_and_cycle(number)
            if order[number] != default:
                row["stages"] = order[number]
            row |= _differing_times(cycle, known)
            plans.append(row)
        result["plans"] = plans
        return result

    def _offset_and_cycle(self, number: int) -> dict[str, float]:
        """Offset, for what SUMO starts with (it counts all phases as one cycle), and cycle."""
        program, stages = self._plans[number].program, self._cycles[number]
        cycle = sum(s.seconds + sum(step.seconds for step in s.steps) for s in stages)
        if program.params.get("coordinated") == "true":
            kept = _param_number(program.params, "cycleTime", cycle)
            offset = {"offset": (program.offset - stages[0].seconds) % kept}
            return offset | ({"cycle": kept} if self._is_actuated() else {})
        total = sum(phase.seconds for phase in program.phases)
        start = -program.offset % total
        return {"offset": (first_stage_at(program) - start) % cycle}

    def _designed_stage(self, stage: FileStage, taken: set[str]) -> dict[str, Any]:
        protected: list[str] = []
        permissive: list[str] = []
        for name, links in self._groups.items():
            letters = {stage.state[n] for n in links}
            if letters & {"G", "g"}:
                (permissive if "g" in letters else protected).append(name)
        name, number = stage.id, len(taken) + 1
        while not name or name in taken:
            name, number = str(number), number + 1
        made: dict[str, Any] = {"id": name, "green": stage.seconds}
        made |= {"protected": protected} if protected else {}
        made |= {"permissive": permissive} if permissive else {}
        made |= {"min_green": stage.least} if stage.least != stage.seconds else {}
        made |= {"max_green": stage.most} if stage.most != stage.seconds else {}
        made |= {"on_call": True} if stage.on_call else {}
        return made

    # Intergreens

    def _intergreen_rows(self, design: dict[str, Any]) -> list[list[object]]:
        """Rows for the intergreens that differ from what follows from the paths."""
        rows: dict[tuple[str, str], float] = {}
        for _ in range(len(self._groups) ** 2):
            program = DesignedProgram(
                _validate_design(
                    {**design, "intergreens": [[*pair, s] for pair, s in rows.items()]}
                ),
                self._light,
                "fixed",
            )
            changed = False
            for taken, plan, cycle in zip(self._plans, program.plans(), self._cycles, strict=True):
                refuse_repeated(taken.program.place, cycle, known=len(plan.stages))
                following = (*plan.stages[1:], plan.stages[0])
                for stage, other, shown in zip(plan.stages, following, cycle, strict=True):
                    beginning = sorted(beginning_groups(stage, other))
                    for name in sorted(stage.groups - other.groups):
                        wanted = shown_need(self._groups[name], shown)
                        changed |= _fit_row(program, rows, name, beginning, wanted)
            if not changed:
                break
        return [[*pair, seconds] for pair, seconds in sorted(rows.items())]

    def _compare_with_file(self, timing: JunctionTiming) -> None:
        """Make sure that the stages give what the file shows; note where only ``g`` differs."""
        program = DesignedProgram(timing, self._light, "fixed")
        for taken, plan, cycle in zip(self._plans, program.plans(), self._cycles, strict=True):
            following = (*plan.stages[1:], plan.stages[0])
            for stage, other, shown in zip(plan.stages, following, cycle, strict=True):
                ours = [(shown.seconds, stage_state(program, stage))]
                ours += [(step.seconds, step.state) for step in change_steps(program, stage, other)]
                theirs = [(shown.seconds, shown.state)]
                theirs += [(phase.seconds, phase.state) for phase in joined_steps(shown.steps)]
                self._compare_states(taken.program, f"after stage {stage.id!r}", ours, theirs)

    def _compare_states(
        self,
        program: FileProgram,
        where: str,
        ours: list[tuple[float, str]],
        theirs: list[tuple[float, str]],
    ) -> None:
        ours, theirs = (
            [(s, self._blank_unconnected(state)) for s, state in rows] for rows in (ours, theirs)
        )
        plain = [[(s, state.lower()) for s, state in rows] for rows in (ours, theirs)]
        if plain[0] != plain[1]:
            shown, made = (
                ", ".join(f"{seconds:g} s {state}" for seconds, state in rows)
                for rows in (theirs, ours)
            )
            raise InputError(
                f"{program.place}: {where} it shows {shown}, which stages and intergreens cannot "
                f"say; they would give {made}"
            )
        for (_, our), (_, their) in zip(ours, theirs, strict=True):
            for n, (letter, was) in enumerate(zip(our, their, strict=True)):
                if letter != was:
                    name = self._light.movements[n].exact_name
                    why = (
                        "it gives way to others" if letter == "g" else "it has nothing to yield to"
                    )
                    self._notes.append(f"{program.place}: {name} shows {letter} for {was}: {why}")

    def _blank_unconnected(self, state: str) -> str:
        """A state whose letters for no connection are red: nobody sees them."""
        movements = self._light.movements
        return "".join(
            letter if movement.turn else "r"
            for letter, movement in zip(state, movements, strict=True)
        )


def _differing_times(
    cycle: Sequence[FileStage], known: Mapping[str, Mapping[str, Any]]
) -> dict[str, dict[str, float]]:
    """Times of stages in a plan that are not those of the program."""
    found: dict[str, dict[str, float]] = {}
    for stage in cycle:
        design = known[stage.id]
        bounds = {"min_green": stage.least, "max_green": stage.most}
        for key, value in {"green": stage.seconds, **bounds}.items():
            usual = design.get(key)
            if usual is None:
                usual = design["green"] if key == "green" else stage.seconds
            if value != usual:
                found.setdefault(key, {})[stage.id] = value
    return found


def _yellow_lengths(letters: Sequence[tuple[float, str]]) -> Iterator[float]:
    """Seconds of yellow after each green in a cycle of seconds and letters."""
    shown = [letter in "Gg" for _, letter in letters]
    ends = [n for n in range(len(letters)) if shown[n - 1] and not shown[n]]
    for end in ends:
        seconds = 0.0
        for length, letter in (*letters[end:], *letters[:end]):
            if letter != "y":
                break
            seconds += length
        yield seconds


def _validate_design(design: dict[str, Any]) -> JunctionTiming:
    return validated(JunctionTiming, design)


def _fit_row(
    program: DesignedProgram,
    rows: dict[tuple[str, str], float],
    name: str,
    beginning: Sequence[str],
    wanted: float,
) -> bool:
    """Change a row so that a group ends as it does in the file; whether that was needed."""
    needs = {follower: program.intergreen(name, follower) for follower in beginning}
    longest = max(needs.values(), default=0.0)
    if longest == wanted or (not longest and program.groups[name].yellow == wanted):
        return False
    if not beginning:
        return False
    if longest > wanted:
        for later_group, seconds in needs.items():
            if seconds > wanted:
                rows[name, later_group] = wanted
    else:
        meeting = [follower for follower in beginning if program.needed(name, follower)[0]] or list(
            beginning
        )
        rows[name, meeting[0]] = wanted
    return True


def _link_numbers(text: str) -> tuple[int, ...]:
    """Numbers of links; what is none is -1, which no light has."""
    return tuple(
        int(word) if word.isascii() and word.isdigit() and len(word) < 6 else -1
        for word in text.split()
    )


class ParameterError(InputError):
    """A parameter of a program is nothing that SUMO could run, whatever else is in force."""


def _param_number(params: Mapping[str, str], key: str, default: float) -> float:
    """Seconds, above 0, that a program of SUMO has as a parameter.

    Raises
    ------
    ParameterError
        If it is another text.
    """
    text = params.get(key)
    if text is None:
        return default
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < _LONGEST_PARAM:
        raise ParameterError(f"parameter {key} is {text[:40]!r}, not a number above 0")
    return value


# --------------------------------------------------------- programs that call the stages of the map
def called_timing(
    light: Light, program: FileProgram, loops: Mapping[str, TakenLoop]
) -> JunctionTiming:
    """Timing of a light whose program calls or extends the stages of the map.

    Raises
    ------
    InputError
        If the map has other stages, or the program does not come back to its first phase.
    """
    greens, offset, gaps = _read_called_stages(program)
    if len(greens) != len(light.green):
        raise InputError(
            f"{program.place}: it calls {len(greens)} stages of the map, but the light of this map "
            f"has {len(light.green)}"
        )
    own = {name: loop for name, loop in loops.items() if loop.name}
    extended = program.params.get(CONTROL_PARAM) == "extended"
    control = "extended" if extended else "actuated"
    made: dict[str, Any] = {"junction": light.names[0], "control": control, "offset": offset}
    made |= {"green": list(greens)} if greens != light.green else {}
    made |= {"detectors": found} if (found := taken_detectors(gaps, own, light)) else {}
    buses = any(f"a:{program.light}.bus." in condition for condition in program.conditions.values())
    return validated(JunctionTiming, made | ({"bus_priority": True} if buses else {}))


def _read_called_stages(
    program: FileProgram,
) -> tuple[tuple[float, ...], float, dict[str, dict[str, float]]]:
    """Stages of a program that calls those of the map: greens, offset, and loops with gaps each.

    Raises
    ------
    InputError
        If it does not come back to its first phase.
    """
    phases = [program.phases[n] for n in main_phases(program)]
    stages = [(match[1], phase) for phase in phases if (match := STAGE_NAME.search(phase.name))]
    cycle = sum(phase.seconds for phase in phases)
    total = sum(phase.seconds for phase in program.phases)
    gaps = {
        name: {
            loop: float(gap) for loop, gap in GAP.findall(program.conditions.get(f"end{name}", ""))
        }
        for name, _ in stages
    }
    offset = -((total - program.offset) % total) % cycle
    return tuple(phase.seconds for _, phase in stages), offset, gaps
