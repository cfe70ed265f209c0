"""Experiments with hands, grasps and control loops, and the study of the original paper."""
