//! Plots and the HTML report, from plain results.
