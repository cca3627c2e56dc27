"""From where a fit begins when the rig file is far off, or gives no values."""
