"""Benchmarks: cases as data, measurements of time and error, tables and figures."""
