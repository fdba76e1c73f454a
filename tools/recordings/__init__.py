"""Recordings of joint movements: read files of other programs, examine, learn and write them."""
