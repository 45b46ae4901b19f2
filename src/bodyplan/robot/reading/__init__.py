"""Robots from the files of others: URDF and MJCF, as trees of links and then as chains of D-H rows."""
