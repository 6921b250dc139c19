"""Wheels of equal sectors: bladed disks from the matrices of one sector."""
