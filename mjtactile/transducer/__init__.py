"""What hardware reports of readings: sensing elements, their imperfections, an array of them and its calibration."""
