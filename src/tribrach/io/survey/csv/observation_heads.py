"""Heads of tables of observations as other programs write them, in our own names.

``von; nach; Höhenunterschied [m]; Länge [km]``, ``from_point, to_point, dE, dN, dH, cov_EE``: the
words over columns of sights, angles, levelling lines and vectors, in the languages that lists of
coordinates know (:mod:`.headings`). What a head means is told in a sentence. A unit of an angle or
of a standard deviation is never guessed, nor whether a distance is along the slope: all that is
open is asked in one refusal.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.survey.csv.columns import ANGLE, LENGTH, QUANTITIES
from tribrach.io.survey.csv.headings import BRACKETS, Heads, letters

#: words over columns by our name of the column, as :func:`letters` leaves them. English, German,
#: French, Spanish, Italian, Portuguese, Dutch, Czech, Polish
_WORDS: dict[str, str] = {
    "from": "from frompoint frompt frompointid frompointname fromid fromstation fromstn frommark "
    "pointfrom start startpoint startpunkt backsight bs backsightpoint backsightstation "
    "von vonpunkt anfangspunkt ausgangspunkt "
    "ruckblick rueckblick anschlusspunkt de depuis depoint dupoint pointdedepart origine desde "
    "depunto desdepunto puntoinicial origen da dapunto puntodipartenza deponto pontoinicial van "
    "vanpunt beginpunt od odbodu zbodu zpunktu odpunktu punktpoczatkowy",
    "to": "to topoint topt topointid topointname toid tostation tostn tomark pointto end endpoint "
    "foresight fs foresightpoint foresightstation target targetpoint targetid "
    "nach nachpunkt endpunkt zielpunkt ziel vorblick a au aupoint vers pointvise "
    "hasta apunto hastapunto puntofinal puntovisado alpunto puntodiarrivo para aponto aoponto "
    "pontofinal pontovisado naar naarpunt eindpunt do nabod kbodu dobodu cilovybod dopunktu "
    "punktkoncowy cel",
    "at": "at atpoint atpt atid atstation vertex scheitel scheitelpunkt sommet vertice hoekpunt "
    "vrchol wierzcholek",
    "station": "station stationname stn stnname setup setuppoint "
    "standpunkt instrumentenstandpunkt estacion stazione "
    "estacao standplaats stanovisko stanowisko occupiedpoint occupied occupy occ",
    "set": "set setid setno satz satznummer serie series round rounds",
    "height_difference": "heightdifference heightdiff elevationdifference elevationdiff elevdiff "
    "deltah deltaheight deltaelevation dh dheight rise hohenunterschied hoehenunterschied "
    "hohendifferenz hoehendifferenz dhohe dhoehe denivelee denivele differencedhauteur "
    "differencedaltitude desnivel diferenciadealtura diferenciadecota dislivello desnivelada "
    "diferencadenivel hoogteverschil prevyseni vyskovyrozdil przewyzszenie roznicawysokosci",
    "length": "length linelength sectionlength lange laenge streckenlange streckenlaenge weglange "
    "linienlange nivellementlange longueur longitud lunghezza comprimento lengte delka dlugosc "
    "dlugoscodcinka delkaoddilu",
    "direction": "direction horizontaldirection ha hz hzdirection richtung horizontalrichtung "
    "hzrichtung direccion direccionhorizontal direzione direcao directionhorizontale richting "
    "smer vodorovnysmer osnova kierunek",
    "angle": "angle horizontalangle horangle hzangle winkel horizontalwinkel brechungswinkel "
    "angulo angulohorizontal angolo angoloorizzontale anglehorizontal hoek horizontalehoek uhel "
    "vodorovnyuhel kat katpoziomy",
    "zenith": "zenith zenithangle zenithdistance zenitwinkel zenithwinkel zenitdistanz "
    "anglezenithal distancezenithale angulocenital distanciacenital angolozenitale angulozenital "
    "zenithoek zenitovyuhel zenitka katzenitalny v vz va verticalcircle",
    "azimuth": "azimuth azimut bearing gisement acimut azymut richtungswinkel smernik",
    "slope_distance": "slopedistance slopedist slopedis sd sdist schragstrecke schraegstrecke "
    "schragdistanz schraegdistanz raumstrecke distanceinclinee distancesuivantlapente "
    "distanciainclinada distanciageometrica distanzainclinata schuineafstand sikmadelka "
    "odlegloscskosna dlugoscskosna",
    "horizontal_distance": "horizontaldistance horizontaldist horizdist hdist hd "
    "horizontalstrecke horizontaldistanz distancehorizontale distanciahorizontal "
    "distanciareducida distanzaorizzontale horizontaleafstand vodorovnadelka odlegloscpozioma "
    "dlugoscpozioma",
    "?distance": "distance dist distances d strecke distanz entfernung distancia distanza afstand "
    "vzdalenost odleglosc",
    "height_instrument": "hi ih instrumentheight heightofinstrument heightinstrument "
    "instrumentenhohe instrumentenhoehe hauteurinstrument hauteurdinstrument alturainstrumento "
    "alturadeinstrumento alturadelinstrumento altezzastrumento altezzastrumentale "
    "alturadoinstrumento instrumenthoogte vyskapristroje vyskastroje wysokoscinstrumentu",
    "height_target": "ht th targetheight prismheight reflectorheight rodheight heightoftarget "
    "zielhohe zielhoehe zielpunkthohe reflektorhohe prismenhohe hauteurprisme hauteurdeprisme "
    "hauteurvise alturaprisma alturadeprisma alturadelprisma altezzaprisma alturadoprisma "
    "prismahoogte vyskacile wysokoscsygnalu wysokosccelu wysokoscpryzmatu",
    "de": "deast deasting deltae deltaeast deltaeasting",
    "dn": "dn dnorth dnorthing deltan deltanorth deltanorthing",
    "du": "du dup deltau deltaup",
    "dx": "dx deltax",
    "dy": "dy deltay",
    "dz": "dz deltaz",
    "comment": "comment remark remarks note notes bemerkung kommentar remarque observaciones note "
    "osservazioni observacoes opmerking poznamka uwagi",
}
#: columns that say nothing that is adjusted, and are left out
_HARMLESS_WORDS = (
    "id obsid no nr num number nummer lfdnr lp index row date datum fecha data time zeit uhrzeit "
    "hora ora line linie session operator beobachter instrument weather wetter obstype type typ"
)
_HARMLESS = frozenset(_HARMLESS_WORDS.split())
_MEANING = {word: name for name, words in _WORDS.items() for word in words.split()}
#: units as heads have them, by ours
_UNITS = {name: name for name in (*LENGTH, *ANGLE, "m2", "mm2", "ppm")} | {
    "meter": "m", "metre": "m", "meters": "m", "metres": "m", "millimeter": "mm",
    "millimetre": "mm", "feet": "ft", "foot": "ft", "ftus": "usft", "grad": "gon", "grads": "gon",
    "gr": "gon", "g": "gon", "gons": "gon", "degree": "deg", "degrees": "deg", "dd": "deg",
    "grados": "deg", "radian": "rad", "radians": "rad", "sec": "arcsec", "seconds": "arcsec",
}  # fmt: skip
_SIGNS = {"°": "deg", '"': "arcsec", "''": "arcsec", "″": "arcsec", "m²": "m2", "mm²": "mm2"}
_LAST = re.compile(r"^(.*?)[\s_/,.-]+(?:in\s+)?([A-Za-z]+2?)$")
#: what stands before the name of a quantity in the head of its standard deviation
_SIGMA = re.compile(
    r"(?:standarddeviation|standardabweichung|standarderror|stddev|stdev|stdabw|stderr|ecarttype|"
    r"desviacion|deviazione|sigma|std|sd|rms|s|m)(?:of|von|de)?"
)
_COVARIANCE = re.compile(r"(?:cov|kov|vcv|var|c|q)([enuhxyz])([enuhxyz])$")
#: quantities whose unit is one of angles
_ANGULAR = {"direction", "angle", "zenith", "azimuth"}
#: columns of names and words
_KEYS = ("from", "to", "at", "station", "target", "set", "comment")


def observation_heads(
    path: Path, line: int, titles: Sequence[str], known: Sequence[str]
) -> Heads | None:
    """What the heads of a table of observations mean; None if it is none that we know.

    ``known``: our names of the columns that are known already, "" for the others.
    """
    if not {"range", "target"} & set(map(_bare, known)):
        # ours of a scanner, and in tables of others an end of a sight
        known = ["" if name == "station" else name for name in known]
    parts = [_parts(title) for title in titles]
    meanings = [
        None if name else _meaning(words) for name, (words, _) in zip(known, parts, strict=True)
    ]
    every = {m for m in meanings if m} | {_bare(name) for name in known if name}
    if "dn" in every:
        # one word of two meanings: the east of a vector, and French and Spanish for from
        east = [k for k, (words, _) in enumerate(parts) if letters(words) == "de"]
        meanings = ["de" if k in east else m for k, m in enumerate(meanings)]
        meanings = ["du" if m == "height_difference" else m for m in meanings]
        every = {m for m in meanings if m} | {_bare(name) for name in known if name}
    if "station" in every and {"from", "to"} <= every:
        meanings = ["at" if m == "station" else m for m in meanings]
    elif "station" in every and "to" in every:
        meanings = ["from" if m == "station" else m for m in meanings]
    every = {m for m in meanings if m} | {_bare(name) for name in known if name}
    measured = every - {*_KEYS, "height_instrument", "height_target", "length"}
    ends = {"from", "to"} <= every or {"station", "target"} <= every
    if not ends or not measured:
        return None
    level = "height_difference" in every and not every & {"direction", "zenith", "angle"}
    names = list(known)
    said: list[str] = []
    open_: list[tuple[str, str]] = []
    metres: list[str] = []
    left: list[str] = []
    unknown: list[str] = []
    have = {_bare(name) for name in known if name}
    for k, (title, meaning, (_, unit)) in enumerate(zip(titles, meanings, parts, strict=True)):
        if known[k] or not title.strip():
            continue
        if meaning == "?distance" and level:
            meaning = "length"
        if meaning is None or meaning in have:
            (left if letters(parts[k][0]) in _HARMLESS else unknown).append(title.strip())
            continue
        have.add(meaning)
        if meaning == "?distance":
            open_.append((title, "horizontal_distance_m or slope_distance_m"))
        elif meaning in _KEYS:
            names[k] = meaning
        elif unit is not None and unit not in QUANTITIES[meaning]:
            open_.append((title, f"{meaning}_{QUANTITIES[meaning][0]}"))
        elif unit is not None:
            names[k] = f"{meaning}_{unit}"
        elif meaning.startswith("sigma") or QUANTITIES[meaning][0] not in ("m", "m2"):
            units = QUANTITIES[meaning][:2]
            if meaning == "sigma":
                units = ("arcsec", "deg") if every & _ANGULAR else ("mm", "m")
            open_.append((title, " or ".join(f"{meaning}_{unit}" for unit in units)))
        else:
            names[k] = f"{meaning}_{QUANTITIES[meaning][0]}"
            metres.append(title.strip())
        if names[k] and letters(title) != meaning:
            said.append(f"{title.strip()} is {meaning.replace('_', ' ')}")
    if not said and not open_ and not left and not metres:
        # the names are ours: what is wrong with them is told elsewhere
        return None
    if unknown:
        one = len(unknown) == 1
        raise InputError(
            f"column{'' if one else 's'} {', '.join(unknown)} {'is' if one else 'are'} not known",
            file=path,
            line=line,
            cure=f"name {'it' if one else 'them'} as the documentation of tables does, or remove "
            f"{'it' if one else 'them'}",
        )
    if open_:
        raise _question(path, line, open_)
    remarks = [f"heads are taken as follows: {', '.join(said)}"] if said else []
    if metres:
        remarks.append(f"no unit is given for {', '.join(metres)}: metres are taken")
    if left:
        remarks.append(f"columns that are left out: {', '.join(left)}")
    return Heads(tuple(names), tuple(remarks))


def _question(path: Path, line: int, open_: Sequence[tuple[str, str]]) -> InputError:
    """What the heads leave open, and how to say it."""
    titles = [title.strip() for title, _ in open_]
    one = len(titles) == 1
    return InputError(
        f"column{'' if one else 's'} {', '.join(titles)} {'does' if one else 'do'} not say "
        f"{'its' if one else 'their'} unit, or what is measured",
        file=path,
        line=line,
        cure="; ".join(f"name {title.strip()} {choice}" for title, choice in open_),
    )


def _parts(title: str) -> tuple[str, str | None]:
    """Words and unit of a head, such as ``Winkel [gon]``."""
    for found in BRACKETS.finditer(title):
        inside = found.group(1).strip()
        unit = _SIGNS.get(inside) or _UNITS.get(letters(inside))
        if unit is not None:
            return title[: found.start()] + title[found.end() :], unit
    title = BRACKETS.sub(" ", title)
    last = _LAST.match(title.strip())
    if last and last.group(2).lower() in _UNITS and letters(title) not in _MEANING:
        return last.group(1), _UNITS[last.group(2).lower()]
    return title, None


def _meaning(words: str) -> str | None:
    """Our column name for a head, without its unit."""
    plain = letters(words)
    if plain in _MEANING:
        return _MEANING[plain]
    if found := _COVARIANCE.match(plain):
        pair = "".join(found.groups()).replace("h", "u")
        return next((f"c{p}" for p in (pair, pair[::-1]) if f"c{p}" in QUANTITIES), None)
    if found := _SIGMA.match(plain):
        rest = plain[found.end() :]
        if not rest:
            return "sigma"
        quantity = _MEANING.get(rest)
        return f"sigma_{quantity}" if f"sigma_{quantity}" in QUANTITIES else None
    return None


def _bare(name: str) -> str:
    """One of our names without its unit."""
    quantity, _, unit = name.rpartition("_")
    return quantity if unit in _UNITS and quantity else name
