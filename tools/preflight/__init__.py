"""What a machine can promise before an arm is moved by it."""
