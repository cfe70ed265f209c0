"""What is measured with hands, grasps and control loops, and the study this package grew from."""
