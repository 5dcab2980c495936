"""Adapters, one file for each package whose mesh objects tetsimplify takes."""
