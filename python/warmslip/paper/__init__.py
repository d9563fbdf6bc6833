"""What belongs to the paper alone: readings of its data and the acceptance of its figures."""
