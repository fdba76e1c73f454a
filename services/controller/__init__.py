"""The 1 kHz controller: answers every state of the arm with a command."""
