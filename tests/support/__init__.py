"""What several tests share: bodies, scenes, commands, processes."""
