"""Surveys of features, made in memory, on which the decision of the diagnosis is learned."""
