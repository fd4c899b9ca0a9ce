"""What signs and lights mean, by country and code: the table behind :func:`sign_meaning`.

A code is what ``type`` says, or ``type`` and ``subtype`` joined, in lower case. Each country has
the catalogue that its road law names; numbers of the same figure differ between countries (101 is a
danger in Germany and a group of prohibitions in China), so ``country`` decides which one is read.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final, Literal

if TYPE_CHECKING:
    from odscen.opendrive.road_model import Signal

SignMeaning = Literal[
    "traffic_light",
    "pedestrian_light",
    "stop",
    "yield",
    "priority",
    "end_of_priority",
    "speed_limit",
    "end_of_speed_limit",
    "no_entry",
    "bus_lane",
    "crosswalk",
]

# ASAM OpenDRIVE, signals of the country "OpenDRIVE" (1.4, section 6.11; 1.8, section 14.1).
_OPENDRIVE: Final[dict[str, SignMeaning]] = {
    "1000001": "traffic_light",
    "1000002": "pedestrian_light",
}

# StVO, Anlagen 1 to 3, and the Katalog der Verkehrszeichen (VzKat 2017).
_DE: Final[dict[str, SignMeaning]] = {
    "205": "yield",
    "206": "stop",
    "301": "priority",
    "306": "priority",
    "307": "end_of_priority",
    "267": "no_entry",
    "245": "bus_lane",
    "350": "crosswalk",
    "274": "speed_limit",
    "274.1": "speed_limit",
    "274.2": "end_of_speed_limit",
    "278": "end_of_speed_limit",
    "282": "end_of_speed_limit",
}

# Manual on Uniform Traffic Control Devices (FHWA, 11th edition), chapters 2B, 2C, 2G.
_US: Final[dict[str, SignMeaning]] = {
    "r1-1": "stop",
    "r1-2": "yield",
    "r1-5": "crosswalk",
    "r1-6": "crosswalk",
    "r2-1": "speed_limit",
    "r2-12": "end_of_speed_limit",
    "r3-11": "bus_lane",
    "r5-1": "no_entry",
    "w11-2": "crosswalk",
}

# Traffic Signs Regulations and General Directions 2016 (SI 2016/362), numbers of diagrams.
_GB: Final[dict[str, SignMeaning]] = {
    "601.1": "stop",
    "602": "yield",
    "616": "no_entry",
    "670": "speed_limit",
    "671": "end_of_speed_limit",
    "674": "speed_limit",
    "958": "bus_lane",
    "959": "bus_lane",
    "959b": "bus_lane",
    "3000": "traffic_light",
}

# Instruction interministérielle sur la signalisation routière, parts 3 and 4.
_FR: Final[dict[str, SignMeaning]] = {
    "ab3a": "yield",
    "ab4": "stop",
    "ab2": "priority",
    "ab6": "priority",
    "ab7": "end_of_priority",
    "b1": "no_entry",
    "b14": "speed_limit",
    "b30": "speed_limit",
    "b31": "end_of_speed_limit",
    "b33": "end_of_speed_limit",
    "b27a": "bus_lane",
    "c20a": "crosswalk",
}

# Vägmärkesförordning (2007:90), chapter 2.
_SE: Final[dict[str, SignMeaning]] = {
    "b1": "yield",
    "b2": "stop",
    "b3": "crosswalk",
    "b4": "priority",
    "b5": "end_of_priority",
    "c1": "no_entry",
    "c31": "speed_limit",
    "c32": "end_of_speed_limit",
    "d10": "bus_lane",
}

# Order on Road Signs, Road Lines and Road Surface Markings (1960), tables 1 and 2. The road ahead
# has priority (329 no 2, 330 no 2 with a stop): Road Traffic Act, article 36.
_JP: Final[dict[str, SignMeaning]] = {
    "329-2": "yield",
    "330": "stop",
    "330-2": "stop",
    "330-a": "stop",
    "330-b": "stop",
    "303": "no_entry",
    "323": "speed_limit",
    "327-4": "bus_lane",
    "405": "priority",
    "407-a": "crosswalk",
    "407-b": "crosswalk",
}

# Traffic rules of the Russian Federation, annex 1; GOST R 52290.
_RU: Final[dict[str, SignMeaning]] = {
    "2.1": "priority",
    "2.2": "end_of_priority",
    "2.3.1": "priority",
    "2.4": "yield",
    "2.5": "stop",
    "3.1": "no_entry",
    "3.24": "speed_limit",
    "3.25": "end_of_speed_limit",
    "3.31": "end_of_speed_limit",
    "5.14": "bus_lane",
    "5.19.1": "crosswalk",
    "5.19.2": "crosswalk",
}

# GB 5768.2-2009: prohibitions (group 101 of GB/T 30699-2014) by their number.
_CN: Final[dict[str, SignMeaning]] = {
    "101-1": "stop",
    "101-2": "yield",
    "101-5": "no_entry",
    "101-38": "speed_limit",
    "101-39": "end_of_speed_limit",
}

# Reglement verkeersregels en verkeerstekens 1990, annex 1.
_NL: Final[dict[str, SignMeaning]] = {
    "b6": "yield",
    "b7": "stop",
    "b1": "priority",
    "b2": "end_of_priority",
    "c2": "no_entry",
    "a1": "speed_limit",
    "a2": "end_of_speed_limit",
    "f13": "bus_lane",
    "l2": "crosswalk",
}

# Royal decree of 1 December 1975, articles 67 to 71.
_BE: Final[dict[str, SignMeaning]] = {
    "b1": "yield",
    "b5": "stop",
    "b9": "priority",
    "b11": "end_of_priority",
    "c1": "no_entry",
    "c43": "speed_limit",
    "c45": "end_of_speed_limit",
    "f17": "bus_lane",
    "f49": "crosswalk",
}

# Regulation on road signs and signals of 31 July 2002; codes without their hyphens.
_PL: Final[dict[str, SignMeaning]] = {
    "a7": "yield",
    "b20": "stop",
    "d1": "priority",
    "d2": "end_of_priority",
    "b2": "no_entry",
    "b33": "speed_limit",
    "b34": "end_of_speed_limit",
    "d11": "bus_lane",
    "d12": "bus_lane",
    "d6": "crosswalk",
}

# Decree 294/2015, annexes.
_CZ: Final[dict[str, SignMeaning]] = {
    "p4": "yield",
    "p6": "stop",
    "p2": "priority",
    "p3": "end_of_priority",
    "b2": "no_entry",
    "b20a": "speed_limit",
    "b20b": "end_of_speed_limit",
    "ip6": "crosswalk",
}

# Signalisationsverordnung (SSV), annex 2.
_CH: Final[dict[str, SignMeaning]] = {
    "3.02": "yield",
    "3.01": "stop",
    "3.03": "priority",
    "3.04": "end_of_priority",
    "2.02": "no_entry",
    "2.30": "speed_limit",
    "2.53": "end_of_speed_limit",
    "2.64": "bus_lane",
    "4.11": "crosswalk",
}

# Reglamento General de Circulación, annex I; codes without their hyphens.
_ES: Final[dict[str, SignMeaning]] = {
    "r1": "yield",
    "r2": "stop",
    "r3": "priority",
    "r4": "end_of_priority",
    "r101": "no_entry",
    "r301": "speed_limit",
    "r501": "end_of_speed_limit",
    "s13": "crosswalk",
}

# Skiltforskriften (2005).
_NO: Final[dict[str, SignMeaning]] = {
    "202": "yield",
    "204": "stop",
    "206": "priority",
    "208": "end_of_priority",
    "302": "no_entry",
    "362": "speed_limit",
    "364": "end_of_speed_limit",
    "508.1": "bus_lane",
    "516": "crosswalk",
}

# Enforcement rule of the Road Traffic Act, annex 6.
_KR: Final[dict[str, SignMeaning]] = {
    "228": "yield",
    "227": "stop",
    "211": "no_entry",
    "224": "speed_limit",
    "330": "bus_lane",
    "322": "crosswalk",
}

# AS 1742, regulatory signs; codes without their hyphens.
_AU: Final[dict[str, SignMeaning]] = {
    "r12": "yield",
    "r11": "stop",
    "r24": "no_entry",
    "r41": "speed_limit",
}

# Manual of Uniform Traffic Control Devices for Canada; codes without their hyphens.
_CA: Final[dict[str, SignMeaning]] = {
    "ra2": "yield",
    "ra1": "stop",
    "rb23": "no_entry",
    "rb1": "speed_limit",
}

_CATALOGUES: Final[dict[str, dict[str, SignMeaning]]] = {
    "DE": _DE,
    "US": _US,
    "GB": _GB,
    "FR": _FR,
    "SE": _SE,
    "JP": _JP,
    "RU": _RU,
    "CN": _CN,
    "NL": _NL,
    "BE": _BE,
    "PL": _PL,
    "CZ": _CZ,
    "CH": _CH,
    "ES": _ES,
    "NO": _NO,
    "KR": _KR,
    "AU": _AU,
    "CA": _CA,
}

# Names of 1.4 and codes of ISO 3166-1 alpha-3, which older versions write.
_COUNTRIES: Final[dict[str, str]] = {
    "DEU": "DE",
    "GERMANY": "DE",
    "USA": "US",
    "GBR": "GB",
    "UK": "GB",
    "FRA": "FR",
    "FRANCE": "FR",
    "SWE": "SE",
    "SWEDEN": "SE",
    "JPN": "JP",
    "JAPAN": "JP",
    "RUS": "RU",
    "RUSSIA": "RU",
    "CHN": "CN",
    "CHINA": "CN",
    "NLD": "NL",
    "BEL": "BE",
    "POL": "PL",
    "CZE": "CZ",
    "CHE": "CH",
    "ESP": "ES",
    "NOR": "NO",
    "KOR": "KR",
    "AUS": "AU",
    "CAN": "CA",
}

_WITHOUT_HYPHENS: Final = frozenset({"PL", "ES", "AU", "CA"})
"""Countries whose codes stand above without the hyphens that files have or leave out."""

OWN_NUMBERS: Final = frozenset({"JP", "KR", "NO"})
"""Countries in which the German numbers, which many writers use everywhere, are other signs."""

_NO_SUBTYPE: Final = frozenset({"", "-1", "none"})


def country_of(signal: Signal) -> str:
    """Country of a signal as two letters, ``OPENDRIVE``, or whatever the file says instead."""
    name = signal.country.strip().upper()
    return _COUNTRIES.get(name, name)


def sign_meaning(signal: Signal) -> SignMeaning | None:
    """What the catalogue of its country, or that of OpenDRIVE, says that a signal means.

    Without a country the German and the American catalogue are read, whose codes differ.
    """
    code = re.sub(r"\s+", "", signal.type.lower())
    if code.startswith("1.000."):  # as the tables of 1.4 print them
        code = code.replace(".", "")
    if code in _OPENDRIVE:
        return _OPENDRIVE[code]
    country = country_of(signal)
    catalogue = _CATALOGUES.get(country)
    if catalogue is None:
        if country not in {"", "OPENDRIVE"}:
            return None
        catalogue = {**_DE, **_US}
    subtype = signal.subtype.strip().lower()
    codes = [code]
    if subtype not in _NO_SUBTYPE:
        codes = [f"{code}{mark}{subtype}" for mark in ("-", ".", "")] + codes
    # German numbers carry the value behind a stroke, as 274-50 does.
    if country in _WITHOUT_HYPHENS:
        codes += [name.replace("-", "") for name in codes]
    codes.append(code.partition("-")[0])
    return next((catalogue[name] for name in codes if name in catalogue), None)
