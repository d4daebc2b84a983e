"""From measured differences to Rows."""

import numpy as np

from mlscorr.frames import pose_partials
from mlscorr.gap.residuals._covariates import covariates, scanner_origin, to_scanner_or_nan
from mlscorr.gap.residuals.patches import Patches
from mlscorr.gap.residuals.rows import Rows, SamplePulses, reference_of
from mlscorr.survey import Survey


def assemble(
    survey: Survey,
    channel: str | list[str] | np.ndarray,
    item: np.ndarray,
    gps_time: np.ndarray,
    position: np.ndarray,
    direction: np.ndarray,
    residual: np.ndarray,
    noise: np.ndarray,
    points: np.ndarray,
    pulses: SamplePulses,
    pass_number: np.ndarray,
    gps_time_2: np.ndarray | None = None,
    survey_item: np.ndarray | None = None,
    survey_factor: np.ndarray | None = None,
    believed: np.ndarray | None = None,
) -> Rows:
    """Rows of a survey, with partials and covariates.

    Parameters
    ----------
    survey : Survey
    channel, ..., believed : (m, ...) arrays
        As in Rows. What isn't given is nothing: one time, no survey error, no belief.
    pulses : SamplePulses
    pass_number : (m,) int array
        From 1.
    """
    m = len(item)
    if gps_time_2 is None:
        gps_time_2 = np.full(m, np.nan)
    if survey_factor is None:
        survey_factor = np.zeros((m, 3))
    second = np.isfinite(gps_time_2)
    partials_2 = np.zeros((m, 6))
    partials_2[second] = -_partials(survey, position[second], gps_time_2[second], direction[second])
    return Rows(
        channel=np.broadcast_to(np.asarray(channel, dtype="U11"), m).copy(),
        item=item,
        survey_item=np.full(m, -1) if survey_item is None else survey_item,
        gps_time=gps_time,
        gps_time_2=gps_time_2,
        position=position,
        direction=direction,
        residual=residual,
        noise=noise,
        survey=np.sum(survey_factor**2, axis=1),
        survey_factor=survey_factor,
        points=points,
        believed=np.full(m, np.nan) if believed is None else believed,
        partials=_partials(survey, position, gps_time, direction),
        partials_2=partials_2,
        covariates=covariates(survey, gps_time, position, pulses, item, pass_number, direction),
        pulses=pulses,
        targets=survey.surveyed,
        reference=reference_of(survey),
    )


def _partials(survey, position, gps_time, direction):
    """Partial derivatives (m, 6) along the directions by the pose."""
    return np.einsum("mi,mij->mj", direction, pose_partials(survey.trajectory, position, gps_time))


def sample_pulses(
    survey: Survey,
    item: np.ndarray,
    weight: np.ndarray,
    xyz: np.ndarray,
    gps_time: np.ndarray,
    intensity: np.ndarray,
    normal: np.ndarray,
) -> SamplePulses:
    """Pulses that made points on surfaces.

    Parameters
    ----------
    survey : Survey
    item, weight, xyz, gps_time, intensity, normal : (k, ...) arrays
        As in SamplePulses.
    """
    beam = xyz - scanner_origin(survey, gps_time)
    beam /= np.linalg.norm(beam, axis=1, keepdims=True)
    return SamplePulses(
        item=item,
        weight=weight,
        gps_time=gps_time,
        xyz=xyz,
        scanner_xyz=to_scanner_or_nan(survey, xyz, gps_time),
        intensity=intensity.astype(float),
        normal=normal,
        incidence=np.abs(np.einsum("ki,ki->k", beam, normal)),
    )


def patch_pulses(
    survey: Survey, patches: Patches, item: np.ndarray, sign: float = 1.0
) -> SamplePulses:
    """Pulses of patches.

    Parameters
    ----------
    survey : Survey
    patches : Patches
    item : (p,) int array
        Of each patch.
    sign : float
        -1 for the second patches of pairs.
    """
    p, samples = patches.time.shape
    return sample_pulses(
        survey,
        np.repeat(item, samples),
        np.full(p * samples, sign / samples),
        patches.xyz.reshape(-1, 3),
        patches.time.ravel(),
        patches.intensity.ravel(),
        np.repeat(patches.normal, samples, axis=0),
    )
