"""A small crossing for tests: legs that run up to one junction, with straight ways through it."""

from __future__ import annotations

from tests.opendrive.snippets import document, lane, road, section

LENGTH = 60.0
"""Metres of a leg."""

GAP = 10.0
"""Metres from the middle of the junction to the ends of its legs."""

_ANGLES = {"1": (1, 0), "2": (0, 1), "3": (-1, 0), "4": (0, -1)}
_HEADINGS = {"1": 0.0, "2": 1.5707963267948966, "3": 3.141592653589793, "4": -1.5707963267948966}
OPPOSITE = {"1": "3", "3": "1", "2": "4", "4": "2"}


def signal(number: int, kind: str, orientation: str = "+", s: float = 58.0, more: str = "") -> str:
    """One signal without validity; ``more`` are further attributes."""
    return (
        f'<signal id="{number}" s="{s}" t="-4" name="" type="{kind}" subtype="-1" '
        f'orientation="{orientation}" dynamic="yes" {more}/>'
    )


def leg(name: str, *signals: str, lanes: tuple[int, ...] = (1, -1)) -> str:
    """A road that ends at the junction; lane -1 leads there, lane 1 away."""
    dx, dy = _ANGLES[name]
    x, y = -dx * (GAP + LENGTH), -dy * (GAP + LENGTH)
    plan = (
        f'<geometry s="0" x="{x}" y="{y}" hdg="{_HEADINGS[name]}" length="{LENGTH}"><line/>'
        "</geometry>"
    )
    return road(
        name,
        length=LENGTH,
        plan=plan,
        lanes=section(*(lane(number) for number in lanes)),
        link='<successor elementType="junction" elementId="9"/>',
        inside=f"<signals>{''.join(signals)}</signals>" if signals else "",
    )


def way(source: str, *, inside: str = "", links: str | None = None, successor: str = "") -> str:
    """The connecting road from a leg straight on; its id is that of the leg and a zero."""
    dx, dy = _ANGLES[source]
    plan = (
        f'<geometry s="0" x="{-dx * GAP}" y="{-dy * GAP}" hdg="{_HEADINGS[source]}" '
        f'length="{2 * GAP}"><line/></geometry>'
    )
    on = '<link><predecessor id="-1"/><successor id="1"/></link>' if links is None else links
    return road(
        f"{source}0",
        length=2 * GAP,
        plan=plan,
        lanes=section(lane(-1, inside=on)),
        link=f'<predecessor elementType="road" elementId="{source}" contactPoint="end"/>'
        + (
            successor
            or f'<successor elementType="road" elementId="{OPPOSITE[source]}" contactPoint="end"/>'
        ),
        junction="9",
        inside=inside,
    )


def entry(source: str, links: str = '<laneLink from="-1" to="-1"/>') -> str:
    """The connection of a leg and its way through the junction."""
    return (
        f'<connection id="{source}" incomingRoad="{source}" connectingRoad="{source}0" '
        f'contactPoint="start">{links}</connection>'
    )


def junction(*parts: str) -> str:
    """The junction with its connections and controllers."""
    return f'<junction id="9" name="">{"".join(parts)}</junction>'


def controller(number: str, *signals: int) -> str:
    """A controller of signals."""
    controls = "".join(f'<control signalId="{one}" type=""/>' for one in signals)
    return f'<controller id="{number}" name="">{controls}</controller>'


def listed(*controllers: str) -> str:
    """What a junction says of its controllers."""
    return "".join(f'<controller id="{one}" type=""/>' for one in controllers)


def crossing(signals: dict[str, str], *more: str, controllers: tuple[str, ...] = ()) -> str:
    """A crossing of four legs with a signal on some of them; ``more`` are further elements."""
    names = ("1", "2", "3", "4")
    legs = [leg(name, *([signals[name]] if name in signals else [])) for name in names]
    ways = [way(name) for name in names]
    return document(
        *legs, *ways, *more, junction(*(entry(name) for name in names), listed(*controllers))
    )
