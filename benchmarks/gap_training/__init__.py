"""Synthetic surveys at feature level, on which the decision of the diagnosis is trained."""
