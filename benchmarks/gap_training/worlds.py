"""Synthetic surveys of features with errors of all sorts: worlds on which a decision is trained.

A world is a drive with targets and patches, the observations of a scanner, and a sky. Its errors
come from simulated sensors, from sums of sinusoids, or from a random walk through a crude smoother,
where survey and extraction often have heavier tails than assumed: nothing is drawn from the
estimator's model.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from gap_training.errors import odd_patches, process, scatter
from gap_training.features import Geometry, geometry
from mlscorr.frames import georeference
from mlscorr.gap.residuals import Background, Rows, background, with_loss_variance
from mlscorr.gap.signatures import Signature, signatures
from mlscorr.simulate.pos import PosError, interpolate, pos_error
from mlscorr.simulate.scenario import PosScenario
from mlscorr.survey import Survey

KINDS = ("sensors", "sensors", "sines", "walk")  # of errors, drawn evenly
PATCHES = (60, 1000)  # drawn evenly by their logs: a short street to as many as are compared
RECORDINGS = 6  # of a world's sensors: each costs a fifth of a diagnosis
SCALE = 0.2  # of the log of the ratio of error to stated sigma: good software knows its noise
RAISED = (0.3, 0.4)  # mean and spread of the same in outages, where it knows less (pos_study.py)


@dataclass(frozen=True)
class World:
    """A geometry with its signatures and its sky.

    Parameters
    ----------
    geometry : Geometry
    signatures : tuple of Signature
    recordings : tuple of (Survey, PosError)
        Recording of the drive by sensors, and its error.
    is_open : bool
        True if GNSS is available throughout.
    heavy : bool
        True if survey and extraction errors have heavy tails.
    """

    geometry: Geometry
    signatures: tuple[Signature, ...]
    recordings: tuple[tuple[Survey, PosError], ...]
    is_open: bool
    heavy: bool

    @classmethod
    def random(cls, seed: int) -> World:
        """World of a seed."""
        rng = np.random.default_rng([seed, 0])
        shared = bool(rng.random() < 0.4)
        targets = int(rng.integers(14, 45))
        passes = 2 if shared or rng.random() < 0.6 else 1
        if shared or rng.random() < 0.7:
            patches = int(np.exp(rng.uniform(*np.log(PATCHES))))
        else:
            patches = 0
        made = geometry(
            seed,
            targets,
            patches,
            passes,
            rough=bool(patches and rng.random() < 0.8),
            shared=shared,
            duration=float(rng.uniform(45.0, 80.0)),
        )
        is_open = bool(rng.random() < 0.5)
        scenario = _scenario(rng, made.survey.trajectory, is_open)
        recordings = tuple(_recorded(made.survey, scenario, rng) for _ in range(RECORDINGS))
        signs, _ = signatures(made.rows, made.survey)
        return cls(made, signs, recordings, is_open, bool(rng.random() < 0.5))

    def errors(self, rng: Generator) -> tuple[Rows, Background, Survey]:
        """Rows without an effect, and the survey that states their errors.

        Parameters
        ----------
        rng : Generator
        """
        rows = self.geometry.rows
        kind = str(rng.choice(KINDS))
        survey, error = self.recordings[rng.integers(len(self.recordings))]
        m = len(rows)
        known = survey.trajectory.gps_time
        time = np.append(rows.gps_time, np.where(rows.two_times, rows.gps_time_2, rows.gps_time))
        if kind == "sensors":
            pose = interpolate(time, known, np.hstack([error.position, error.attitude]))
        else:
            sigmas = np.hstack([error.position_sigma, error.attitude_sigma])
            pose = interpolate(time, known, sigmas) * np.exp(SCALE * rng.standard_normal())
            pose[:, :3] *= self._growth(rng, time, survey)[:, None]
            order = np.argsort(time)
            for i in range(6):
                pose[order, i] *= process(rng, time[order], kind)
        attitude = survey.trajectory.at(time).attitude
        pose[:, 3:] = attitude.apply(pose[:, [4, 3, 5]] * [1.0, 1.0, -1.0])  # about body axes
        residual = np.einsum("mi,mi->m", rows.partials, pose[:m])
        residual += np.einsum("mi,mi->m", rows.partials_2, pose[m:])
        residual += scatter(rows, rng, self.heavy) + odd_patches(rows, rng)
        beams = rows.pulses.scanner_xyz, rows.pulses.gps_time
        xyz = georeference(survey.trajectory, survey.mounting, *beams)  # as they are recorded
        pulses = replace(rows.pulses, xyz=xyz)
        rows = with_loss_variance(replace(rows, residual=residual, pulses=pulses))
        return rows, background(rows, survey), survey

    def _growth(self, rng, time, survey):
        """Factor (n,) on sigma: a POS knows its outages, but not its errors."""
        sigma = np.linalg.norm(survey.trajectory.position_sigma, axis=1)
        raised = np.interp(time, survey.trajectory.gps_time, sigma) > 2 * np.percentile(sigma, 5)
        return np.where(raised, np.exp(RAISED[0] + RAISED[1] * rng.standard_normal()), 1.0)


def _scenario(rng, trajectory, is_open):
    """Sensors and sky: a bad sky means a canyon or an outage in some pass."""
    length = float(np.diff(trajectory.passes[0])[0])
    span = float(rng.uniform(6.0, 25.0))
    spans = ((float(rng.uniform(0.0, max(length - span, 1.0))), span),)
    outage = bool(rng.random() < 0.4)
    return PosScenario(
        grade="mems" if rng.random() < 0.2 else "tactical",
        processing="filtered" if rng.random() < 0.15 else "smoothed",
        outages=spans if outage and not is_open else (),
        canyons=spans if not outage and not is_open else (),
    )


def _recorded(survey, scenario, rng):
    """The survey as recorded by sensors, and its error."""
    true = survey.trajectory
    parts = []
    for start, end in true.passes:
        inside = (true.gps_time >= start) & (true.gps_time <= end)
        parts.append(pos_error(true.select(inside), scenario, rng))
    columns = ("position", "attitude", "position_sigma", "attitude_sigma")
    error = PosError(*(np.concatenate([getattr(p, name) for p in parts]) for name in columns))
    recorded = replace(
        true,
        position=true.position + error.position,
        position_sigma=error.position_sigma,
        attitude_sigma=error.attitude_sigma,
    )
    return replace(survey, trajectory=recorded), error
