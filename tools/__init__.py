"""What people run beside the services."""
