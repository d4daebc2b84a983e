"""What to do about a verdict, in sentences."""

NEXT = {  # by effect: what a surveyor can do, beside the simulator
    "time_offset": "Have the time synchronisation of the scanner checked; until then, shift its "
    "time stamps by the size found.",
    "clock_drift": "Have the scanner's clock steered by the POS; a drift that stays is a fault.",
    "time_jitter": "Check how the scanner's pulses are time-stamped: by the POS's second pulse, or "
    "by the computer that stores them.",
    "boresight": "Run mlscorr calibrate, which estimates the mounting from the targets.",
    "lever_arm": "Run mlscorr calibrate, which estimates the mounting from the targets.",
    "range_bias": "Have the scanner's zero range checked on a base line.",
    "range_scale": "Check temperature and pressure in the scanner's range correction.",
    "range_walk": "Ask the maker for the scanner's range correction by intensity.",
    "incidence_bias": "Check ranges at grazing incidence against a known plane.",
    "angle_scale": "Have the scanner's encoder checked.",
    "angle_eccentricity": "Have the scanner's encoder checked.",
    "heading_drift": "Process the trajectory again: a heading that drifts points to GNSS with too "
    "few turns, or a gyro's bias.",
    "position_step": "Process the trajectory again; mlscorr correct takes such a drift out of the "
    "cloud.",
    "position_bump": "Look at GNSS at that time; mlscorr correct takes such a drift out of the "
    "cloud.",
    "position_noise": "Run mlscorr correct, which takes the drift out of the cloud; tell it how "
    "well the POS is known with the sigmas found.",
    "vertical_datum": "Check the heights' datum and geoid of control and trajectory.",
    "horizontal_datum": "Check CRS and datum of control and trajectory.",
    "map_rotation": "Check CRS and datum of control and trajectory.",
    "map_scale": "Check CRS and projection scale of control and trajectory.",
    "target_outlier": "Survey that target again, or take it out of the control.",
    "dropout": "Look for wet or dark surfaces, or a dirty window of the scanner.",
}
AGAIN = (
    "Run mlscorr diagnose once more with --simulator simulator.toml of this folder: it has the "
    "cause in it, and the next run finds what is left, or nothing."
)


def advise(verdict, same, next_data, impostor=None):
    """What to do: a list of sentences.

    Parameters
    ----------
    verdict : Verdict
    same : tuple of str
        Effects that the survey can't tell from the label.
    next_data : tuple of NextData
    impostor : Closure, optional
        Of the best known effect, where the verdict is unknown.
    """
    told = []
    open_question = [n for n in (*verdict.set, *same) if n not in ("none", verdict.label)]
    if verdict.label == "none":
        told.append("Nothing needs to be done: what is left agrees with what the simulator says.")
    elif verdict.label == "unknown":
        told.append(f"Look for what makes a {verdict.lead}: no effect of the library does.")
        if impostor is not None and impostor.effect != "none":
            told.append(
                f"The nearest known effect, {impostor.effect}, closes "
                f"{100 * max(0.0, min(1.0, impostor.shrink)):.0f} % of the gap and leaves "
                "the rest: don't use it."
            )
    else:
        told += [NEXT[part] for part in verdict.label.split("+") if part in NEXT]
        told.append(AGAIN)
    if open_question and next_data:
        told.append(
            f"To settle what is open ({', '.join(dict.fromkeys(open_question))}), measure "
            f"{next_data[0].survey}: {next_data[0].why}"
        )
    return list(dict.fromkeys(told))
