"""What pictures are drawn on: pages, scenes, and the process that draws."""
