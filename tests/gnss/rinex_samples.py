"""Small RINEX files written by hand, for what goes wrong with files."""

HEADER_2 = """\
     2.11           OBSERVATION DATA    G (GPS)             RINEX VERSION / TYPE
ABCD                                                        MARKER NAME
00000               RECEIVER            1.0                 REC # / TYPE / VERS
1                   TRM29659.00     NONE                    ANT # / TYPE
  4157177.0658   671230.4766  4774767.0311                  APPROX POSITION XYZ
        1.2345        0.0010        0.0020                  ANTENNA: DELTA H/E/N
     4    L1    C1    L2    P2                              # / TYPES OF OBSERV
                                                            END OF HEADER
"""
HEADER_3 = """\
     3.04           OBSERVATION DATA    M: MIXED            RINEX VERSION / TYPE
EFGH                                                        MARKER NAME
G    4 C1C L1C C2W L2W                                      SYS / # / OBS TYPES
                                                            END OF HEADER
"""
VALUES = f"{123456.789:14.3f}  {20000000.123:14.3f}  {98765.432:14.3f}  {20000001.5:14.3f}"


def rinex_2(epochs: int = 3, satellites: tuple[str, ...] = ("G01", "G02", "G03", "G04")) -> str:
    """Epochs every 30 s from 2005-04-02 00:00."""
    lines = []
    for k in range(epochs):
        names = "".join(satellites)
        first, rest = names[:36], [names[i : i + 36] for i in range(36, len(names), 36)]
        head = f" 05  4  2  0{k // 2:3d}{30.0 * (k % 2):11.7f}  0{len(satellites):3d}{first}"
        lines += [head, *(" " * 32 + more for more in rest), *([VALUES] * len(satellites))]
    return HEADER_2 + "\n".join(lines) + "\n"


def rinex_3(epochs: int = 3, satellites: tuple[str, ...] = ("G01", "G02", "G03", "G04")) -> str:
    """The same in RINEX 3."""
    lines = []
    for k in range(epochs):
        lines.append(f"> 2005 04 02 00{k // 2:3d}{30.0 * (k % 2):11.7f}  0{len(satellites):3d}")
        lines += [name + VALUES for name in satellites]
    return HEADER_3 + "\n".join(lines) + "\n"


def navigation(day: int = 2, satellites: int = 5) -> str:
    """A navigation file of RINEX 2 with orbits of zeros at noon."""
    head = (
        "     2.10           N: GPS NAV DATA                         RINEX VERSION / TYPE\n"
        "                                                            END OF HEADER\n"
    )
    zero = " 0.000000000000D+00"
    records = []
    for k in range(1, satellites + 1):
        records.append(f"{k:2d} 05  4 {day:2d}  0  0  0.0" + zero * 3)
        records += ["   " + zero * 4] * 7
    return head + "\n".join(records) + "\n"
