"""Benchmarks: cases as data, what they take and how far off they are, tables and figures of it."""
