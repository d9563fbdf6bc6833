"""The time loop: run, statistics, checkpoint, summary."""
