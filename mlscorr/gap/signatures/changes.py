"""Changes of the rows by an effect: its own function applied, with and without, through Eq. 1.

Effects turn the truth into the record; to first order they have the same effect on the record.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from mlscorr.effects import Effect, Returns
from mlscorr.gap.residuals import Rows
from mlscorr.gap.signatures.settings import SETTINGS
from mlscorr.survey import Survey, Trajectory

FIELDS = ("gps_time", "angle", "range")  # of Returns, that move a point


@dataclass(frozen=True)
class Change:
    """Change of the rows by one effect.

    Parameters
    ----------
    shift : (m,) array
        Of the residual, in its unit.
    variance : (m,) array
        Variance that a random effect adds to the residual, for addition to Rows.noise.
    growth : (m,) array
        For a roughness row, the variance added about the plane over the assumed one: the row's mean
        increases by log(1 + growth).
    """

    shift: np.ndarray
    variance: np.ndarray
    growth: np.ndarray


@dataclass(frozen=True)
class Bench:
    """Rows and their survey, prepared for trying effects."""

    rows: Rows
    survey: Survey

    def change(self, effect: Effect, rng: np.random.Generator | None = None) -> Change:
        """Compute the change of the rows by an effect.

        Parameters
        ----------
        effect : Effect
        rng : numpy.random.Generator, optional
            For random ones.

        Raises
        ------
        ValueError
            If a stage needs the mounting and that is unknown.
        """
        m = len(self.rows)
        stage = effect.stage
        check_mounting(self.survey, [effect])
        shift = np.zeros(m)
        variance = np.zeros(m)
        growth = np.zeros(m)
        rng = np.random.default_rng(0) if rng is None else rng
        if stage == "return":
            shift = self._lost(effect, rng)
        elif effect.is_of_pose():
            variance = self._pose_variance(effect, rng)
        elif stage == "pos":
            shift = self._pose_shift(effect.apply(self._trajectory, self.rows.reference))
        elif stage == "control":
            shift = self._control_shift(effect)
        elif stage == "mounting":
            mounting = effect.apply(self.survey.mounting, self.rows.reference)
            shift = self._along(self._moved(mounting=mounting))
        elif stage != "beam" and effect.random:
            variance, growth = self._scatter(effect, rng)
        elif stage != "beam":
            shift = self._along(self._moved(effect.apply(self.returns, self.rows.reference)))
        return Change(shift, variance, growth)

    @cached_property
    def returns(self) -> Returns:
        """Pulses as input of effects, in order of time."""
        pulses = self.rows.pulses
        x, y, z = pulses.scanner_xyz[self._order].T
        return Returns(
            gps_time=pulses.gps_time[self._order],
            angle=np.arctan2(y, x),
            range=np.sqrt(x**2 + y**2 + z**2),
            intensity=pulses.intensity[self._order],
            incidence=pulses.incidence[self._order],
            kept=np.ones(len(pulses), dtype=bool),
        )

    @cached_property
    def _order(self):
        return np.argsort(self.rows.pulses.gps_time, kind="stable")

    @cached_property
    def _pulses(self):
        return self.rows.pulses[self._order]

    @cached_property
    def _pose(self):
        return self.survey.trajectory.at(self._pulses.gps_time)

    @cached_property
    def _body(self):
        """Pulses (k, 3) in the body frame, as recorded. Units: m."""
        return self._pose.attitude.inv().apply(self._pulses.xyz - self._pose.position)

    def _moved(self, returns=None, mounting=None):
        """Shift of pulses (k, 3) on the map if these are recorded instead. Units: m."""
        body = self._body
        pose = self._pose
        recorded = self.survey.mounting
        if returns is not None and not self._same(returns, "angle", "range"):
            body = recorded.boresight.apply(self._scanner_xyz(returns)) + recorded.lever_arm
        if mounting is not None:
            body = mounting.boresight.apply(self._pulses.scanner_xyz) + mounting.lever_arm
        if returns is not None and not self._same(returns, "gps_time"):
            pose = self.survey.trajectory.at(self._within_passes(returns.gps_time))
        return pose.attitude.apply(body) + (pose.position - self._pulses.xyz)

    def _same(self, returns, *names):
        return all(getattr(returns, name) is getattr(self.returns, name) for name in names)

    def _scanner_xyz(self, returns):
        """X_L (k, 3) of changed returns with the same elevation out of the scan plane. Units: m."""
        sine = self._pulses.scanner_xyz[:, 2] / self.returns.range
        flat = returns.range * np.sqrt(1.0 - sine**2)
        return np.column_stack(
            [flat * np.cos(returns.angle), flat * np.sin(returns.angle), returns.range * sine]
        )

    def _within_passes(self, gps_time):
        """Times (k,) limited to the passes of the pulses, which they may leave at the ends."""
        trajectory = self.survey.trajectory
        starts, ends = trajectory.passes.T
        number = trajectory.segment(self._pulses.gps_time)
        return np.clip(gps_time, starts[number], ends[number])

    def _along(self, moved):
        """Shift of the residuals (m,) from moves (k, 3) of the pulses."""
        return np.einsum("mi,mi->m", self.rows.direction, self._weights @ moved)

    @cached_property
    def _weights(self):
        """Sparse weights (m, k) of the pulses behind each row."""
        items, number = np.unique(self._pulses.item, return_inverse=True)
        entries = self._pulses.weight, (number, np.arange(len(number)))
        return csr_array(entries)[np.searchsorted(items, self.rows.item)]

    def _mean(self, values):
        """Sum (m, ...) over the views of each row's item of the mean of values (k, ...) of its
        pulses.
        """
        return abs(self._weights) @ values

    @cached_property
    def _speeds(self):
        """Speeds of pulses per unit of each of FIELDS: name -> (k, 3)."""
        speeds = {}
        for name, step in zip(FIELDS, (1e-4, 1e-5, 1e-3), strict=True):
            if name != "gps_time" and self.survey.mounting is None:
                continue
            ends = [
                self._moved(replace(self.returns, **{name: getattr(self.returns, name) + h}))
                for h in (-step, step)
            ]
            speeds[name] = (ends[1] - ends[0]) / (2 * step)
        return speeds

    def _scatter(self, effect, rng):
        """Variance and growth (m,) from independent noise of each pulse."""
        _, single, pulse = np.unique(self.returns.gps_time, return_index=True, return_inverse=True)
        pulses = self.returns[single]
        sums = {}
        for _ in range(SETTINGS.random_replicas):
            changed = effect.apply(pulses, self.rows.reference, rng)
            for name in FIELDS:
                if getattr(changed, name) is not getattr(pulses, name):
                    error = getattr(changed, name) - getattr(pulses, name)
                    sums[name] = sums.get(name, 0.0) + error**2
        m = len(self.rows)
        rows = self.rows
        variance = np.zeros(m)
        along_normal = np.zeros(m)
        for name, total in sums.items():
            moved = self._speeds[name] * np.sqrt(total / SETTINGS.random_replicas)[pulse, None]
            along_normal += self._mean(np.einsum("ki,ki->k", moved, self._pulses.normal) ** 2)
            squares = self._mean((moved[:, :, None] * moved[:, None, :]).reshape(-1, 9))
            along = np.einsum("mi,mj->mij", rows.direction, rows.direction).reshape(-1, 9)
            variance += np.einsum("mi,mi->m", along, squares)
        rough = rows.channel == "roughness"
        growth = np.where(rough, along_normal / np.where(rough, rows.assumed, 1.0), 0.0)
        return variance / np.maximum(rows.points, 1), growth

    def _lost(self, effect, rng):
        """Shift (m,) of the share of returns."""
        replicas = SETTINGS.random_replicas if effect.random else 1
        kept = sum(
            effect.apply(self.returns, self.rows.reference, rng).kept for _ in range(replicas)
        )
        share = self._mean(kept / replicas)
        return np.where(self.rows.channel == "return_rate", self.rows.assumed * (share - 1.0), 0.0)

    @cached_property
    def _trajectory(self):
        """Recorded trajectory, thinned without changing its gaps, and with the epochs around
        each row, where a jump may otherwise become a slope.
        """
        whole = self.survey.trajectory
        last = len(self.survey.trajectory) - 1
        step = max(1, int(SETTINGS.epoch_step / np.median(np.diff(whole.gps_time))))
        ends = np.searchsorted(whole.gps_time, whole.gaps).ravel()
        times = self.rows.gps_time, self.rows.gps_time_2[self.rows.two_times]
        after = np.searchsorted(whole.gps_time, np.concatenate(times), side="right")
        rows = np.unique(np.r_[0:last:step, ends, after - 1, np.minimum(after, last), last])
        session = None if whole.session is None else whole.session[rows]
        pose = whole.gps_time[rows], whole.position[rows], whole.attitude[rows]
        thin = Trajectory(*pose, session=session)
        if np.array_equal(thin.gaps, whole.gaps):
            return thin
        return whole

    def _pose_shift(self, changed):
        """Shift (m,) of the residuals if this is recorded instead of the thinned trajectory."""
        recorded = self._trajectory
        pose = np.zeros((len(recorded), 6))
        pose[:, :3] = changed.position - recorded.position
        if changed.attitude is not recorded.attitude:
            pose[:, 3:] = (changed.attitude * recorded.attitude.inv()).as_rotvec()
        return self._by_pose @ pose.ravel()

    @cached_property
    def _by_pose(self):
        """Sparse derivative (m, 6 e) of the rows by the poses at the e epochs: each view is
        between two of them.
        """
        rows = self.rows
        epochs = self._trajectory.gps_time
        second = np.where(rows.two_times, rows.gps_time_2, rows.gps_time)
        m = len(rows)
        legs = []
        for time, partials in ((rows.gps_time, rows.partials), (second, rows.partials_2)):
            before = np.clip(np.searchsorted(epochs, time, side="right") - 1, 0, len(epochs) - 2)
            weight = (time - epochs[before]) / (epochs[before + 1] - epochs[before])
            for epoch, share in ((before, 1 - weight), (before + 1, weight)):
                columns = 6 * epoch[:, None] + np.arange(6)
                entries = (share[:, None] * partials).ravel(), columns.ravel(), 6 * np.arange(m + 1)
                legs.append(csr_array(entries, shape=(m, 6 * len(epochs))))
        return sum(legs)

    def _pose_variance(self, effect, rng):
        """Variance (m,) from noise of the recorded trajectory, which rows of a moment share."""
        given = (self._trajectory, self.rows.reference, rng)
        replicas = SETTINGS.random_replicas
        return sum(self._pose_shift(effect.apply(*given)) ** 2 for _ in range(replicas)) / replicas

    def _control_shift(self, effect):
        """Shift (m,) of the residuals, observed - surveyed, from moved surveyed targets."""
        rows = self.rows
        targets = self.rows.targets
        shift = np.zeros(len(rows))
        if len(targets) == 0:
            return shift
        moved = effect.apply(targets, rows.reference).position - targets.position
        on = rows.survey_item >= 0
        shift[on] = -np.einsum("mi,mi->m", rows.direction[on], moved[rows.survey_item[on]])
        return shift


def check_mounting(survey: Survey, effects: Iterable[Effect]) -> None:
    """Refuse effects on beams if the mounting is unknown.

    Parameters
    ----------
    survey : Survey
    effects : iterable of Effect

    Raises
    ------
    ValueError
        If an effect acts on the beams of a survey without a mounting.
    """
    for effect in effects:
        if survey.mounting is None and effect.needs_mounting():
            raise ValueError(
                f"{effect.name} acts on the {effect.stage}, and {survey.path} has no [mounting], "
                "so the beams are unknown."
            )
