"""The harness that grades the diagnosis on surveys with sealed labels."""
