"""Non-geometric channels: intensity, density, lost returns and edges, real versus simulated."""

from mlscorr.gap.contrast.channels import contrast_clouds, contrast_returns
from mlscorr.gap.contrast.distances import (
    DistributionDistance,
    cloud_distances,
    innovation_distances,
    replica_innovations,
)
from mlscorr.gap.contrast.sample import SampleCollector
from mlscorr.gap.contrast.tables import Contrast
