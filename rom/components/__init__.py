"""Engineering components on the light layers."""
