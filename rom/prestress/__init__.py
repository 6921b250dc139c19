"""What stress does to vibrations: heat that stiffens or buckles, and steady rotation at large."""
