"""Python side of the engine plugin: registration, attributes, tables, warnings and counts."""
