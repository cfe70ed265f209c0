"""Contact of rigid bodies with a pad: footprints, contact laws, and the tractions that carry a wrench."""
