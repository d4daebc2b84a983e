"""Selection of some of many ties."""

from dataclasses import replace

import numpy as np

from mlscorr.surfaces import direction_class, join_features
from mlscorr.survey import Ties
from mlscorr.ties import SETTINGS, thinned_ties
from tests.beds import tie_streets as street
from tests.surfaces.test_thinning import crowd


def test_a_second_has_no_more_ties_with_ten_later_passes_than_with_two():
    "As many of each direction, with every pass about as many, whatever the order of the ties"
    rng = np.random.default_rng(3)
    per_pass = 200
    features = crowd()[:per_pass]
    for passes in (2, 10):
        again = [
            replace(
                features,
                pass_number=np.full(per_pass, 2 + later),
                gps_time=features.gps_time + 100.0 * (1 + later),
            )
            for later in range(passes)
        ]
        both = join_features([features, *again], street.ORIGIN)
        assert len(both) == (1 + passes) * per_pass
        first = np.flatnonzero(both.pass_number == features.pass_number[0])
        later = [np.flatnonzero(both.pass_number == 2 + k) for k in range(passes)]
        pairs = np.concatenate([np.column_stack([first, rows]) for rows in later])
        pairs = rng.permutation(pairs)
        ties = Ties.between(both, pairs, both.direction[pairs[:, 0]], np.full(len(pairs), 1e-4))
        kept = thinned_ties(ties)
        bins = direction_class(kept.direction)
        assert np.bincount(np.minimum(bins, 26 - bins)).max() == SETTINGS.ties
        counts = np.bincount(kept.pass_number[:, 1])[2:]
        assert counts.max() < 2 * len(kept) / passes
        assert (counts > 0).all()
