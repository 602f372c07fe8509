"""Measured data: readers of files, checks of sensors and clocks, segmentation into flights and contacts."""
