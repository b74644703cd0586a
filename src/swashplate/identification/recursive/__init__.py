"""Estimates that are carried along a stream of samples: regressions in flight."""
