"""How good recognisers are: measured on fresh presses, through transducers too."""
