"""Which effect explains the difference between a survey and its simulation."""
