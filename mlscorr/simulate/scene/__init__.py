"""Objects along the way: ground, houses, banks or the user's mesh, and the targets."""

from mlscorr.simulate.scene._street import section
from mlscorr.simulate.scene.build import Scene, build_scene, sky_elevation, static_scan
from mlscorr.simulate.scene.centre_line import CentreLine, line_along, plan_lengths, winding_line
from mlscorr.simulate.scene.mesh import line_on_mesh, read_mesh
from mlscorr.simulate.scene.placing import Targets
from mlscorr.simulate.scene.shapes import UP, Mesh, sees
