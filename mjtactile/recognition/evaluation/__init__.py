"""Evaluation of recognisers on new presses, with ideal readings and with transducers."""
