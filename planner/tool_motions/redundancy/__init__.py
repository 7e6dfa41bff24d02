"""Motions of the tool that leave coordinates open: turns about the tool and other offsets, and external axes."""
