"""The verdict on a correction: what it rests on, and what speaks against it."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.estimate import Support
from mlscorr.evaluate import TargetRow
from mlscorr.report.headline import verdict
from tests.beds.reports import because, drive, fabricate

ROLES = ("control", "check")
LOST = TargetRow.unobserved("C9", None, "check", np.zeros(3), because("No target is left for it."))


def held(report):
    "The same report of a drive that control points hold everywhere"
    return replace(report, support=Support())


def test_no_factor_is_boasted_of_where_the_cloud_may_be_as_far_off_as_it_was():
    "An extrapolated part, a missing check point or points left as they were take it away"
    report = held(fabricate(drive())[2])
    untouched = replace(report.coverage, points_outside_trajectory=7)
    lost = replace(report, targets=[*report.targets, LOST])
    assert verdict(report)[0].values["holds_everywhere"]
    for other in (fabricate(drive())[2], lost, replace(report, coverage=untouched)):
        assert not verdict(other)[0].values["holds_everywhere"]
    assert verdict(lost)[0].severity == "fault"


def test_the_verdict_gives_distances_and_what_they_rest_on():
    "From 77.5 cm to 8.0 cm in space, ten times closer, at two check points"
    report = held(fabricate(drive())[2])
    pair = ([0.7081, 0.2043, 0.2398], [0.0602, 0.0401, 0.0353])
    for statistics, rmse in zip((report.check.before, report.check.after), pair, strict=True):
        statistics.rmse[:] = [*rmse, np.hypot(*rmse[:2]), np.linalg.norm(rmse)]
    change, rmse = verdict(report)
    assert (change.key, change.severity, change.values["kind"]) == ("improved", "note", "check")
    assert change.values["before"] == pytest.approx(0.775, abs=5e-4)
    assert change.values["after"] == pytest.approx(0.080, abs=5e-4)
    assert change.values["times"] == pytest.approx(9.6, abs=0.1)
    assert rmse.key == "rmse of check points"
    assert (rmse.values["points"], rmse.values["observations"]) == (2, 2)
    np.testing.assert_allclose(rmse.values["after"], pair[1])


@pytest.mark.parametrize(("sigma", "worse"), [(0.030, False), (0.005, True)])
@pytest.mark.parametrize("checks", [True, False], ids=["check", "left out"])
def test_a_rise_within_its_own_sigma_speaks_against_nothing(sigma, worse, checks):
    "From 8 to 16 mm on each axis, where it is known to 30 mm: no verdict; to 5 mm: a red one"
    report = held(fabricate(drive(), checks=checks)[2])
    known = {role: replace(getattr(report, role), sigma=np.full(3, sigma)) for role in ROLES}
    report = replace(report, **known)
    before, after, _ = report.judgement
    for statistics, rmse in ((before, 0.008), (after, 0.016)):
        statistics.rmse[:] = [rmse] * 3 + [rmse * 2**0.5, rmse * 3**0.5]
    change, _, *axes = verdict(report)
    if worse:
        assert (change.key, change.severity) == ("made worse", "fault")
        assert axes[0].values["rises"] == pytest.approx(dict.fromkeys("ENH", 0.008))
    else:
        assert (change.key, change.severity) == ("changed within sigma", "warning")
        assert axes == []


def test_multiple_passes_are_counted_as_observations_of_points():
    "Eight observations of four points are not eight points"
    report = fabricate(drive(), 8, checks=False, names=["A", "B", "C", "D"] * 2)[2]
    values = verdict(report)[1].values
    assert (values["points"], values["observations"]) == (4, 8)


def test_check_points_that_were_not_seen_are_not_said_to_be_none():
    "A surveyed one without an observation, none that was surveyed, and no surveyed point at all"
    report = fabricate(drive(), checks=False)[2]
    for targets, has_checks in (([*report.targets, LOST], True), (report.targets, False)):
        rmse = verdict(replace(report, targets=targets))[1]
        assert (rmse.key, rmse.values["has_checks"]) == ("rmse left out", has_checks)
    nothing = fabricate(drive(), count=0)[2]
    assert verdict(nothing)[0].key == "nothing to judge by"
    assert verdict(replace(nothing, targets=[LOST]))[0].key == "no target to judge by"
