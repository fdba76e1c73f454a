"""Short programs that each show one thing: see README.md."""
