"""Recordings of joint movements: reading files of other programs, examining, learning and exporting."""
