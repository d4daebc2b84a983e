"""Simulated surveys to be diagnosed, with their scene as a reference surface."""

from dataclasses import dataclass

import numpy as np

from mlscorr.gap.closure import Surroundings, collect_beams
from mlscorr.gap.residuals import PatchCollector, Patches, build_rows
from mlscorr.io.clouds import read_chunks
from mlscorr.pipeline import MatchedTargets
from mlscorr.pipeline.finding import find_or_compare_surfaces


@dataclass(frozen=True)
class Read:
    "Data from one reading of a survey's clouds"

    finding: MatchedTargets
    patches: Patches
    surroundings: Surroundings


def read_once(survey):
    "Targets, patches, and what lies about the targets"
    collector = PatchCollector(survey)
    surroundings = Surroundings(survey)

    def read(file):
        for chunk in read_chunks(file):
            collector.add(file, chunk)
            surroundings.add(chunk)
            yield chunk

    finding, _ = find_or_compare_surfaces(survey, read, surroundings.settle)
    return Read(finding, collector.patches(), surroundings)


def write_reference(simulated, path, shift=(0.0, 0.0, 0.0), lost=0.0):
    "The scene as an OBJ in map coordinates, without a share of its triangles"
    rng = np.random.default_rng(8)
    triangles = simulated.scene.mesh.triangles
    triangles = triangles[rng.random(len(triangles)) >= lost]
    places = triangles.reshape(-1, 3) + np.array(simulated.scenario.origin) + shift
    lines = ["v {:.4f} {:.4f} {:.4f}".format(*place) for place in places]
    lines += [f"f {3 * i + 1} {3 * i + 2} {3 * i + 3}" for i in range(len(triangles))]
    path.write_text("\n".join(lines) + "\n")


def rows_of(survey, read, limit):
    "The Pairing of at most a limit of patches"
    finding = read.finding
    return build_rows(
        survey, finding.matches.matched, finding.candidates, read.patches, limit=limit
    )


def beams_of(survey, rows, read):
    "The Beams of rows"
    return collect_beams(survey, rows, read.finding, read.patches, read.surroundings)
