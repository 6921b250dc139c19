"""What is installed, what works, and what to type for the rest."""
