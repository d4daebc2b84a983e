"""Kalman filter and smoother of an error state."""

from dataclasses import dataclass

import numpy as np

from mlscorr.simulate.pos._inertial import STATES


@dataclass(frozen=True)
class StateEstimate:
    """Estimated error state (n, 15) of a filter or smoother, and its covariance (n, 15, 15)."""

    state: np.ndarray
    covariance: np.ndarray


@dataclass(frozen=True)
class Measurement:
    """Measurement (m,) = design (m, 15) x + noise with covariance (m, m), as assumed by the
    filter.
    """

    design: np.ndarray
    measured: np.ndarray
    covariance: np.ndarray


def kalman_filter(
    transition: np.ndarray, noise: np.ndarray, start: np.ndarray, measurements: dict
) -> tuple[StateEstimate, StateEstimate]:
    """Run the forward pass of the error-state Kalman filter.

    Parameters
    ----------
    transition : (n, 15, 15) array
    noise : (15,) array
        Variances added by a step.
    start : (15,) array
        Variances at the first epoch.
    measurements : dict
        Epoch number -> sequence of Measurement.

    Returns the filtered and the predicted StateEstimate, n + 1 epochs each.
    """
    epochs = len(transition) + 1
    filtered = StateEstimate(np.zeros((epochs, STATES)), np.empty((epochs, STATES, STATES)))
    predicted = StateEstimate(np.zeros((epochs, STATES)), np.empty((epochs, STATES, STATES)))
    state = np.zeros(STATES)
    covariance = np.diag(start)
    process = np.diag(noise)
    for k in range(epochs):
        if k:
            state = transition[k - 1] @ state
            covariance = transition[k - 1] @ covariance @ transition[k - 1].T + process
        predicted.state[k] = state
        predicted.covariance[k] = covariance
        for measurement in measurements.get(k, ()):
            state, covariance = _update(state, covariance, measurement)
        filtered.state[k] = state
        filtered.covariance[k] = covariance
    return filtered, predicted


def _update(state, covariance, measurement):
    """State and covariance after a Measurement; Joseph's form keeps it symmetric and positive."""
    design = measurement.design
    noise = measurement.covariance
    cross = design @ covariance
    gain = np.linalg.solve(cross @ design.T + noise, cross).T
    keep = np.eye(STATES) - gain @ design
    state = state + gain @ (measurement.measured - design @ state)
    return state, keep @ covariance @ keep.T + gain @ noise @ gain.T


def smooth(
    transition: np.ndarray, filtered: StateEstimate, predicted: StateEstimate
) -> StateEstimate:
    """Smooth states in the backward pass of Rauch, Tung and Striebel (1965).

    Parameters
    ----------
    transition : (n, 15, 15) array
        Over each step.
    filtered, predicted : StateEstimate
    """
    forward = transition @ filtered.covariance[:-1]
    gain = np.linalg.solve(predicted.covariance[1:], forward).transpose(0, 2, 1)
    state = filtered.state.copy()
    covariance = filtered.covariance.copy()
    for k in range(len(transition) - 1, -1, -1):
        state[k] += gain[k] @ (state[k + 1] - predicted.state[k + 1])
        covariance[k] += gain[k] @ (covariance[k + 1] - predicted.covariance[k + 1]) @ gain[k].T
    return StateEstimate(state, covariance)
