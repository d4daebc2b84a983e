"""Which effect explains the difference between a survey and its simulation.

The story, a room each:

- observe: rows of observed minus simulated, from targets, surfaces and planes that passes share
- contrast: channels beside geometry, of a real and a simulated cloud
- signatures: what each effect does to these rows, and the simulator as it is believed
- infer: the verdict, causes with their parameters, where the gap lies, what can be told apart
- close: the simulator with the cause in it, on data that were not used to find it
- plan: what to measure next, and what a survey will show before it is driven
- advice, document: what to do about it, and all of it as plain numbers and words
"""

from mlscorr.gap.infer import Costs
