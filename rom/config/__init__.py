"""Files that describe components and mechanisms (TOML), with units, checked by one table."""
