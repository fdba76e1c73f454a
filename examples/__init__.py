"""What Volley can do, one thing a file: see README.md."""
