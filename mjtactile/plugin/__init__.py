"""The engine plugin's Python side: registered, configured, fed with tables; what it warns of and counts."""
