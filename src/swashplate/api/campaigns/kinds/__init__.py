"""What campaigns are of: one file a kind."""
