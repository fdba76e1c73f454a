"""A rally: balls thrown at the arm, returned to a target, scored and recorded."""
