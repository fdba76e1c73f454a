"""Recordings of joint movements: read from other programs' files, looked at, learned, and written out again."""
