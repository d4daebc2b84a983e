"""The page of pos_gap.py: its text and its tables."""

import numpy as np
from page import counted, picture, words, write_page
from pos_drive import FIRST
from pos_figures import draw_by_outage, draw_by_time, draw_errors
from pos_measure import shrunk

REAL = [
    (
        "Real",
        [
            "The drive (GNSS_RTK.pos, 1 Hz) and the position and attitude error of the MEMS unit "
            "against a high-grade reference (10 Hz). This series is the observation.",
            "The outages: GNSS was withheld from a real recording.",
        ],
    ),
    (
        "Simulated",
        [
            "Targets every 5 s beside the drive, seen where the real error puts them; their survey "
            "(3 mm) and extraction (4 mm) are drawn. No cloud was cast.",
            "The attitude of the drive: its course over ground.",
            "What is believed: the simulator's MEMS unit with odometer, in real time.",
        ],
    ),
    (
        "Mind",
        [
            "The simulator's noise of GNSS fixes was once set by this same series between its "
            "outages (its sources say so): that both agree with GNSS is no proof. Growth without "
            "GNSS comes from sensor data sheets.",
            "Few outages, of one drive and one unit.",
            "The diagnosis is not told of the outages; the measurement of the shrinking is, as "
            "any receiver's log tells them.",
        ],
    ),
]


def interval(values, factor=1):
    """Median and interval as text."""
    return "{:.0f} [{:.0f}, {:.0f}]".format(*(factor * v for v in values))


def windows_told(row):
    """Number of windows found, from the first GNSS loss in the notes of the data on."""
    return ", ".join(f"{a - FIRST:.0f} to {b - FIRST:.0f} s" for a, b, _ in row["windows"]) or "-"


def percent(value):
    if value is None:
        return "-"
    return f"{value:.0%}"


def setting_told(settings):
    """Describe a simulated POS."""
    with_wheels = "with" if settings["odometer"] else "without"
    return f"{settings['grade']}, {with_wheels} odometer, {settings['processing']}"


def most_chosen(measured):
    """Index of the settings that were chosen most often."""
    return int(np.bincount([m["chosen"] for m in measured]).argmax())


def write(out, one, r, cycles, measured, believed, models):
    """Write pictures and the page; return its path."""
    sigmas = models[most_chosen(measured)]
    drawn = picture(out / "errors.png", draw_errors, (7.6, 5.6), one, believed, sigmas, cycles)
    by_time = picture(out / "gap_by_time.png", draw_by_time, (7.6, 3.4), cycles, measured)
    by_outage = picture(out / "gap_by_outage.png", draw_by_outage, (7.6, 3.2), r)
    parts = [errors(r, drawn), where(r, by_time), which(r), shrinking(r, by_outage)]
    write_page(
        out / "pos_gap.html",
        "Simulated against real POS error",
        "A MEMS GNSS/INS on a real drive, GNSS withheld 60 s in every 150 s",
        headline(r),
        REAL,
        parts,
    )
    return out / "pos_gap.html"


def headline(r):
    """Sentences for the top of the page."""
    pairs = [p for p in r["pairs"] if "position_noise" in p["verdict"].split("+")]
    count = r["named"].get("two outages", {})
    lost = r["all"]["inside"]
    named = sum(k for label, k in count.items() if "position_noise" in label.split("+"))
    alone = count.get("position_noise", 0)
    every = sum(count.values())
    told = [p for p in pairs if p["windows"]]
    if told:
        found = np.median([p["outage_found"] for p in told])
    else:
        found = 0.0
    if told:
        right = np.median([p["found_in_outage"] for p in told])
    else:
        right = 0.0
    return [
        "The real POS is not the believed one: its position is noisier in windows of time. Shown "
        f"two outages, the diagnosis says so in {named} of {every} cases "
        f"({alone} times as the only cause); the windows it finds cover {found:.0%} of the outages "
        f"and lie in them by {right:.0%} (medians).",
        f"{r['plain_in_outages']:.1%} of the misfit beyond belief lies in the outages.",
        "Told when GNSS was withheld, the simulator states an error that grows: "
        f"{interval(r['medians']['shrink'], 100)} % of the gap's square (by innovations, see "
        "below) is gone on outages that its settings were not chosen on (median, 95 % interval). "
        "Of the plain squared misfit in the outages only "
        f"{shrunk(lost['plain'] ** 2, lost['left'] ** 2):.0%} is: real errors are larger there "
        "than even that simulator states, most of all in height.",
    ]


def errors(r, drawn):
    """Section on the real error, compared with both models."""
    return {
        "title": "The real error against what the simulator states",
        "text": [
            f"Believed is one sigma of {1e3 * r['believed']['position_sigma']:.0f} mm, which the "
            "simulated MEMS unit states while it has GNSS. With the outages in the simulator, "
            "its own Kalman filter lets the sigma grow.",
            f"{r['within_2_sigma'][0]:.0%} of the real errors lie within 2 sigma as believed, "
            f"{r['within_2_sigma'][1]:.0%} with the outages (95 % would be right).",
        ],
        "pictures": [
            (
                drawn,
                "Real error (black) with 2 sigma as believed (orange) and of the "
                "simulator that is told of the outages (blue; cut where it leaves the "
                "axis). Grey: GNSS was withheld.",
            )
        ],
    }


def where(r, by_time):
    """Section on the times at which the gap opens."""
    return {
        "title": "Where",
        "text": [
            "The gap is the misfit that a simulator doesn't account for: the mean square of what "
            "was observed less what it expects, as a signed root in mm. It is zero on average "
            "when the simulator is right, and below zero where it expects too much.",
            f"{r['plain_in_outages']:.1%} of the squared misfit beyond belief lies in "
            f"the outages, where {r['rows_in_outages']:.0%} of the targets were seen.",
            "Innovations, by which the diagnosis adds up the gap, tell it differently: each is "
            "the surprise given all earlier targets. A drift that grows smoothly surprises "
            "less than the return of GNSS, when an error of a metre vanishes from one target "
            f"to the next: only {interval(r['medians']['innovations_in_outage'], 100)} % of "
            "theirs (median) lie inside.",
        ],
        "pictures": [
            (
                by_time,
                "Gap by the time from the start of the outage, all outages "
                "together: by the squared misfit (left) and by innovations (right), as "
                "believed and once the simulator is told of the outages. The scale is "
                "linear below 10 mm. Grey: GNSS was withheld.",
            )
        ],
    }


def which(r):
    """Section on the result of the diagnosis."""
    return {
        "title": "Which",
        "text": [
            "The diagnosis is not told of the outages. What it says of windows with two, one "
            "and none of them is in the tables. Counted over "
            f"{r['layouts']} layout(s) of simulated targets along the same drive:",
            *(f"{kind}: {counted(count)}." for kind, count in r["named"].items()),
        ],
        "tables": [pairs_table(r), cycles_table(r), quiet_table(r)],
    }


def pairs_table(r):
    head = (
        "window (s of week)",
        "diagnosis",
        "probability",
        "noisier in (s)",
        "of the outages found",
        "of that in outages",
    )
    rows = [
        (
            f"{p['span'][0]:.0f} to {p['span'][1]:.0f}",
            words(p["verdict"]),
            f"{p['probability']:.2f}",
            windows_told(p),
            percent(p["outage_found"]),
            percent(p["found_in_outage"]),
        )
        for p in r["pairs"]
    ]
    return (
        head,
        rows,
        (
            f"Two outages each. 'Noisier in' counts from {FIRST:.0f} s, when GNSS was withheld for "
            "the first time: outages are 0 to 60 s, 150 to 210 s, and so on."
        ),
    )


def cycles_table(r):
    bumps = sum("position_bump" in c["verdict"].split("+") for c in r["cycles"])
    rows = [
        (f"{c['outage'][0]:.0f}", words(c["verdict"]), f"{c['probability']:.2f}")
        for c in r["cycles"]
    ]
    return (
        ("outage from (s)", "diagnosis", "probability"),
        rows,
        (
            "One outage each. Alone it is a single event, which one error of the position that "
            f"comes and goes ({words('position_bump')}) may explain, too: named in {bumps} of "
            f"{len(r['cycles'])}."
        ),
    )


def quiet_table(r):
    head = (
        "no outage, window (s)",
        "diagnosis",
        "p of none",
        "gap (mm)",
        "if nothing is wrong (mm)",
    )
    rows = [
        (
            f"{q['span'][0]:.0f} to {q['span'][1]:.0f}",
            words(q["verdict"]),
            f"{q['p_value']:.2f}",
            f"{q['gap']:.0f}",
            "{:.0f} to {:.0f}".format(*q["null_band"]),
        )
        for q in r["quiet"]
    ]
    return (
        head,
        rows,
        (
            "The same real drive before the first outage: whether the diagnosis alarms without "
            "reason. The real error has jolts of up to a decimetre there, too."
        ),
    )


def shrinking(r, by_outage):
    """Section on the closure of the gap once the simulator knows of the outages."""
    head = (
        "outage from (s)",
        "before (mm)",
        "after (mm)",
        "shrink",
        "inside (mm)",
        "outside (mm)",
        "settings chosen on the others",
    )
    rows = [
        (
            f"{c['outage'][0]:.0f}",
            f"{c['before']:.0f}",
            f"{c['after']:.0f}",
            f"{c['shrink']:.0%}",
            "{:.0f} → {:.0f}".format(*c["inside"]),
            "{:.0f} → {:.0f}".format(*c["outside"]),
            setting_told(c["settings"]),
        )
        for c in r["cycles"]
    ]
    return {
        "title": "How far the gap shrinks",
        "text": [
            "The receiver's log says when there was no GNSS; with these times the simulator's "
            "POS runs again. Its grade, odometer and processing are chosen by likelihood on "
            "all outages but the one that is measured.",
            *shrinking_told(r),
            stays_told(r),
        ],
        "pictures": [
            (
                by_outage,
                "Gap of each outage and the 45 s before and after it. Bars: "
                "95 % of what it is if the respective simulator is right.",
            )
        ],
        "tables": [
            (
                head,
                rows,
                "Gap by innovations, of the whole window, and of the targets in "
                "and out of the outage.",
            )
        ],
    }


def shrinking_told(r):
    """The gap before and after, in paragraphs."""
    m = r["medians"]
    lost = r["all"]["inside"]
    held = r["all"]["outside"]
    return [
        f"Median over {len(r['cycles'])} outages: {interval(m['before'])} mm before, "
        f"{interval(m['after'])} mm after (negative: the simulator now expects more); "
        f"{interval(m['shrink'], 100)} % of the square is gone. All together "
        f"{r['shrink_all']:.0%} [{r['shrink_interval'][0]:.0%}, {r['shrink_interval'][1]:.0%}].",
        f"In the outages {lost['before']:.0f} mm become {lost['after']:.0f} mm, outside "
        f"{held['before']:.0f} mm become {held['after']:.0f} mm. As squares of the misfit: "
        f"{lost['plain']:.0f} mm become {lost['left']:.0f} mm inside, {held['plain']:.0f} mm "
        f"become {held['left']:.0f} mm outside.",
        "The other way round: drives of the simulator with outages, judged by the belief "
        f"without, show {r['simulated']['median']:.0f} mm (90 % of them "
        f"{r['simulated']['range'][0]:.0f} to {r['simulated']['range'][1]:.0f} mm), the "
        f"real ones {m['before'][0]:.0f} mm.",
    ]


def stays_told(r):
    """Remaining differences from the simulator with outages, as a paragraph."""
    return (
        "What stays: in the outages the real errors are {:.1f}, {:.1f} and {:.1f} times the "
        "simulated sigma in E, N and H (RMS). Height ends above the truth in {} of {} outages (by "
        "chance: {:.3f}): the real drift is not of zero mean there, as the simulated one is."
    ).format(
        *r["stays"]["over_sigma"],
        r["stays"]["positive"][2],
        len(r["cycles"]),
        r["stays"]["chance"][2],
    )
