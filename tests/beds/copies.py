"""Corrected copies of one cloud file."""

from mlscorr.io.clouds import CorrectedPart, write_parts


def write_corrected(cloud_file, target, correction, watch=None, sigma=None):
    "Copy a CloudFile with corrected coordinates; the number of its points outside the trajectory"
    return write_parts([CorrectedPart(cloud_file, correction, sigma, watch)], target)[0]
