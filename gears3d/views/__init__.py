"""What people look at: the replay, the report, the drawings."""
