//! Scoring against truth: evaluate, calibrate, experiment.
