"""Whether a recording can be of an arm, and what its teacher should know of it, in sentences."""
