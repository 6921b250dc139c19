"""Files: the native body file and other formats."""
