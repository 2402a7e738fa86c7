//! HTML reports and plots from plain results. Each page is self-contained and loads nothing. This module reads and writes no file.

mod calibration_plot;
mod chart;
mod cost_plot;
mod data_url;
mod experiment_page;
mod experiment_tables;
mod flight_map;
mod flight_page;
mod flight_plots;
mod flight_report;
mod gallery;
mod html;
mod mosaic;
mod plan_page;
mod plan_plot;
mod relative_cost_plots;
mod replay_page;
mod replay_plots;
mod replayed_flight;
mod simulation_failures_plot;
mod simulation_page;
mod simulation_plots;
mod stanford_plot;

pub use calibration_plot::calibration_svg;
pub use cost_plot::cost_svg;
pub use experiment_page::experiment_html;
pub use flight_report::FlightReport;
pub use mosaic::Mosaic;
pub use plan_page::plan_html;
pub use plan_plot::plan_svgs;
pub use relative_cost_plots::relative_cost_svgs;
pub use replay_page::replay_html;
pub use replayed_flight::ReplayedFlight;
pub use simulation_page::simulation_html;
pub use simulation_plots::simulation_svgs;
pub use stanford_plot::stanford_svg;
