"""Geometry from measurements and studies of it: fits told and drawn, many jobs on all cores or a cluster."""
