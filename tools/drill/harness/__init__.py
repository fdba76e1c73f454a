"""Robot cells for scenarios: started, observed, disturbed."""
