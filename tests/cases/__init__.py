"""What several tests share; a test file imports no other test file."""
